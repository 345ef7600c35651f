// The vector table; every fault ends in a lockup, which ends QEMU.
.section .start, "a"
.word STACK
.word start
.fill 14, 4, 0

.section .text.start, "ax"
.thumb
.global start
.thumb_func
start:
    // Access to the floating-point unit, where there is one. Elsewhere the register ignores it.
    ldr r0, =0xE000ED88
    movs r1, #0xF
    lsls r1, r1, #20
    str r1, [r0]
    dsb
    isb
    bl bare_main
