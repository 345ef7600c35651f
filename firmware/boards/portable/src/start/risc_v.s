.section .start, "ax"
.global start
start:
    la sp, STACK
    // Switches the floating-point unit on: its state is "initial".
    li t0, 0x2000
    csrs mstatus, t0
    call bare_main
