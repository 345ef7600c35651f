.section .start, "ax"
.arm
.fpu vfpv3-d16
.global start
start:
    ldr sp, =STACK
    // Access to the floating-point unit for all, then its switch.
    mrc p15, 0, r0, c1, c0, 2
    orr r0, r0, #0xF00000
    mcr p15, 0, r0, c1, c0, 2
    isb
    mov r0, #0x40000000
    vmsr fpexc, r0
    bl bare_main
