/* The smallest controller: tables from a file, a servo, one correction after the other. */
#include <stdio.h>
#include "trueaxis.h"

static uint32_t blob[65536]; /* 256 kB, at a multiple of 4 bytes */
static trueaxis_tables_memory tables_memory;
static trueaxis_servo_memory servo_memory;

int main(int count, char **words)
{
    trueaxis_tables *tables;
    trueaxis_servo *servo;
    double position[5] = {100, 30, 45, -50, -120}, correction[5] = {0}; /* Y, A, C, X, Z: see the blob */
    FILE *file = count > 1 ? fopen(words[1], "rb") : NULL;
    size_t length = file ? fread(blob, 1, sizeof blob, file) : 0;
    if (trueaxis_tables_new(TRUEAXIS_HEADER, &tables_memory, sizeof tables_memory, &tables) ||
        trueaxis_tables_load(tables, blob, length) ||
        trueaxis_servo_new(&servo_memory, sizeof servo_memory, tables, &servo))
        return 1;
    trueaxis_servo_enable(servo, 1);
    for (int period = 0; period < 4000; period++) /* in every servo period, here 1 ms */
        if (trueaxis_servo_update(servo, position, 5, 0x1F, 0.001, correction))
            return 1;
    for (int axis = 0; axis < 5; axis++)
        printf("%.6f\n", position[axis] + correction[axis]); /* to the drive */
    return file ? fclose(file) : 1;
}
