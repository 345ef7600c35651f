/* A generated compensation and a servo on a Cortex-M4F, without a blob, a C library or an operating system.
 *
 * `trueaxis generate huron-13.trax --servo --function huron_13 -o huron_13.c` wrote the code. What prints and ends
 * is for QEMU, below.
 */
#include "generated/huron_13.h"

static void print(float value);
static void finish(int failed);

static trueaxis_tables_memory tables_memory;
static trueaxis_servo_memory servo_memory;

int main(void)
{
    static const float position[5] = {100.0f, 30.0f, 45.0f, -50.0f, -120.0f}; /* Y, A, C, X, Z: see the code */
    float correction[5] = {0};
    trueaxis_tables *tables;
    trueaxis_servo *servo;
    if (trueaxis_tables_new(TRUEAXIS_HEADER, &tables_memory, sizeof tables_memory, &tables) ||
        trueaxis_tables_load_generated(tables, &huron_13_generated) ||
        trueaxis_servo_new(&servo_memory, sizeof servo_memory, tables, &servo))
        return 1;
    trueaxis_servo_enable(servo, 1);
    for (int period = 0; period < 4000; period++) /* in every servo period, here 1 ms */
        if (trueaxis_servo_update_f32(servo, position, 5, 0x1F, 0.001f, correction))
            return 1;
    for (int axis = 0; axis < 5; axis++)
        print(position[axis] + correction[axis]); /* to the drive */
    return 0;
}

/* Semihosting: a debugger, or QEMU, serves these calls. */
static void semihosting(int operation, const void *argument)
{
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

/* Six decimals. */
static void print(float value)
{
    char text[24];
    size_t at = sizeof text;
    int64_t rest = (int64_t)((double)value * 1e6 + (value < 0 ? -0.5 : 0.5));
    uint64_t left = (uint64_t)(rest < 0 ? -rest : rest);
    text[--at] = '\0';
    text[--at] = '\n';
    for (int digit = 0; digit < 7 || left > 0; digit++) {
        if (digit == 6)
            text[--at] = '.';
        text[--at] = (char)('0' + left % 10);
        left /= 10;
    }
    if (rest < 0)
        text[--at] = '-';
    semihosting(0x04, &text[at]); /* SYS_WRITE0 */
}

static void finish(int failed)
{
    semihosting(0x18, (const void *)(uintptr_t)(failed ? 0x20023 : 0x20026)); /* SYS_EXIT */
    for (;;) {
    }
}

/* After reset: QEMU has loaded and cleared all variables, and the program switches on the floating-point unit. */
void start(void)
{
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20;
    __asm__ volatile("dsb\n\tisb");
    finish(main());
}

extern char STACK[]; /* of the linker script */
__attribute__((section(".start"), used)) static const void *const vectors[2] = {STACK, (const void *)start};
