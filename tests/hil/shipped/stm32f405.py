"""An STM32F405 as far as the shipped program uses it: the processor by Unicorn, the peripherals after RM0090.

What it has: RCC, FLASH with its errors, GPIO, EXTI, TIM2, USART2 with DMA1, SPI1 with DMA2, RNG, IWDG, the resets. What
it has not: the time that anything takes (a servo period passes at each wait, and an erase takes its longest), wait
states, voltages, a sensor on PB6 and PB7, interrupts of interrupts. Interrupts are taken where the program waits and, in
every `SLICED`th period, after a random number of instructions.
"""

import os
import random
import struct

from unicorn import (UC_ARCH_ARM, UC_HOOK_CODE, UC_HOOK_MEM_WRITE, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError)
from unicorn import arm_const as arm

FLASH, FLASH_SIZE = 0x0800_0000, 1 << 20
RAM, RAM_SIZE = 0x2000_0000, 128 << 10
CCM, CCM_SIZE = 0x1000_0000, 64 << 10
# Where a handler returns to: nothing is there.
RETURN = 0x1FFF_0000
# In every so manieth period the interrupt comes at any place.
SLICED = 20
PERIOD = 250e-6
# Longest erase of a sector of 128 KiB (data sheet, table 40), s.
ERASE = 4.0
# Slowest and fastest oscillator of the watchdog, Hz.
LSI = 47_000
SECTORS = [(n << 14, 1 << 14) for n in range(4)] + [(1 << 16, 1 << 16)]
SECTORS += [((n - 4) << 17, 1 << 17) for n in range(5, 12)]
EXTI4, TIM2 = 10, 28

# Flags of RCC_CSR.
POWER_ON, PIN, SOFTWARE, WATCHDOG, BROWN_OUT = 1 << 27, 1 << 26, 1 << 28, 1 << 29, 1 << 25


class PowerCut(Exception):
    """The power has gone."""


class Reset(Exception):
    """The chip has reset itself; the flag of RCC_CSR says why."""


class Wrong(Exception):
    """The program has done what the manual forbids."""


def segments(path):
    """What an ELF file holds: addresses in flash, and bytes."""
    image = open(path, "rb").read()
    (table,), (size, number) = struct.unpack_from("<I", image, 28), struct.unpack_from("<HH", image, 42)
    for k in range(number):
        kind, offset, _, address, length = struct.unpack_from("<IIIII", image, table + k * size)
        if kind == 1 and length:
            yield address, image[offset : offset + length]


class Chip:
    """A chip with its flash, which outlives its power."""

    def __init__(self, image):
        self.flash = bytearray(b"\xff" * FLASH_SIZE)
        self.program = 0
        for address, bytes_ in segments(image):
            at = address - FLASH
            self.flash[at : at + len(bytes_)] = bytes_
            self.program = max(self.program, at + len(bytes_))
        self.options = 0x0FFF_AAED
        self.random = random.Random(405)
        self.received = bytearray()
        self.sent = bytearray()
        # Words programmed and sectors erased, and the number of the one at which the power goes.
        self.operations = 0
        self.cut_at = None
        self.refuse = lambda address: False
        self.erases = [0] * 12
        self.drives_off = True
        self.sensor_bus = 0b11
        self.ticking = True
        self.starts = 0
        self.periods = 0
        self.power(POWER_ON | PIN | BROWN_OUT)

    # Power and resets.

    def power(self, flags):
        """Switches it on, or resets it with these flags."""
        keeps = self.memory() if not flags & POWER_ON else None
        self.starts += 1
        uc = self.uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        uc.mem_map(FLASH, FLASH_SIZE)
        uc.mem_write(FLASH, bytes(self.flash))
        uc.mem_map(RAM, RAM_SIZE)
        uc.mem_map(CCM, CCM_SIZE)
        uc.mem_map(RETURN, 0x1000)
        # The size of the flash, kB.
        uc.mem_map(0x1FFF_7000, 0x1000)
        uc.mem_write(0x1FFF_7A22, struct.pack("<H", FLASH_SIZE >> 10))
        # What RAM holds after power-on is not defined.
        uc.mem_write(RAM, keeps or self.random.randbytes(RAM_SIZE))
        for base, size, read, write in [
            (0x4000_0000, 0x8_0000, self.read, self.write),
            (0x5006_0000, 0x1000, self.read, self.write),
            (0xE000_0000, 0x10_0000, self.read, self.write),
            (0x4200_0000, 0x200_0000, self.read_bit, self.write_bit),
        ]:
            uc.mmio_map(base, size, lambda _, at, size, base, read=read: read(base + at, size), base,
                        lambda _, at, size, value, base, write=write: write(base + at, size, value), base)
        uc.hook_add(UC_HOOK_MEM_WRITE, self.programmed, begin=FLASH, end=FLASH + FLASH_SIZE - 1)
        for at in range(0, self.program, 2):
            if self.flash[at : at + 2] == b"\x30\xbf":  # WFI
                uc.hook_add(UC_HOOK_CODE, self.waits, begin=FLASH + at, end=FLASH + at)
        self.registers = {0x4002_3874: flags, 0x4002_3C10: 1 << 31, 0x4002_3C00: 0, 0x4000_3008: 0xFFF}
        self.keys = []
        self.option_keys = []
        self.errors = 0
        self.undo = None
        self.streams = {}
        self.waiting = False
        self.problem = None
        self.fed = None
        self.time = 0.0
        self.cycles = 0
        uc.reg_write(arm.UC_ARM_REG_SP, struct.unpack_from("<I", self.flash, 0)[0])
        uc.reg_write(arm.UC_ARM_REG_PRIMASK, 0)
        self.pc = struct.unpack_from("<I", self.flash, 4)[0] | 1

    def memory(self):
        return bytes(self.uc.mem_read(RAM, RAM_SIZE))

    def cut(self):
        """Cuts the power and switches it on again."""
        self.flash[:] = self.uc.mem_read(FLASH, FLASH_SIZE)
        self.cut_at = None
        self.power(POWER_ON | PIN | BROWN_OUT)

    # Running.

    def go(self, address, until, count=0):
        try:
            self.uc.emu_start(address, until, count=count)
        except UcError as error:
            if self.problem is None:
                pc = self.uc.reg_read(arm.UC_ARM_REG_PC)
                raise Wrong(f"{error} at {pc:#x}") from None
        if self.problem is not None:
            problem, self.problem = self.problem, None
            raise problem
        return self.uc.reg_read(arm.UC_ARM_REG_PC)

    def run(self, count=0):
        """Until the program waits or has executed `count` instructions; returns whether it waits."""
        self.waiting = False
        try:
            at = self.go(self.pc, RETURN, count)
        except Reset as reset:
            self.flash[:] = self.uc.mem_read(FLASH, FLASH_SIZE)
            self.power(reset.args[0])
            return False
        self.pc = (at + 2 if self.waiting else at) | 1
        return self.waiting

    def interrupt(self, number):
        """Takes an interrupt, if it is enabled and not masked."""
        enabled = self.registers.get(0xE000_E100 + number // 32 * 4, 0) >> number % 32 & 1
        if not enabled or self.uc.reg_read(arm.UC_ARM_REG_PRIMASK) & 1:
            return False
        before = self.uc.context_save()
        self.uc.reg_write(arm.UC_ARM_REG_SP, (self.uc.reg_read(arm.UC_ARM_REG_SP) - 0x68) & ~7)
        self.uc.reg_write(arm.UC_ARM_REG_LR, RETURN | 1)
        handler = struct.unpack_from("<I", self.flash, 4 * (16 + number))[0]
        try:
            at = self.go(handler | 1, RETURN)
        except Reset as reset:
            self.flash[:] = self.uc.mem_read(FLASH, FLASH_SIZE)
            self.power(reset.args[0])
            return True
        if at & ~1 != RETURN:
            raise Wrong(f"the handler of interrupt {number} waits at {at:#x}")
        self.uc.context_restore(before)
        return True

    def period(self, frame=None):
        """One servo period: by a frame of the motion side, whose answer it returns, or by the timer."""
        self.pass_(PERIOD)
        self.deliver()
        self.periods += 1
        if self.periods % SLICED:
            while not self.run():
                pass
        else:
            self.run(self.random.randrange(1, 2000))
            while self.uc.reg_read(arm.UC_ARM_REG_PRIMASK) & 1:
                self.run(1)
        if frame is None:
            if self.ticking and self.registers.get(0x4000_0000, 0) & 1:
                self.registers[0x4000_0010] = 1
                self.interrupt(TIM2)
            return None
        answer = self.exchange(frame)
        self.registers[0x4001_3C14] = self.registers.get(0x4001_3C14, 0) | 1 << 4
        if not self.interrupt(EXTI4):
            raise Wrong("the end of a frame causes no interrupt")
        return answer

    def pass_(self, seconds):
        """Time passes: the watchdog may bark."""
        self.time += seconds
        self.cycles += round(seconds * 168e6)
        if self.fed is not None and self.time - self.fed > self.patience():
            self.flash[:] = self.uc.mem_read(FLASH, FLASH_SIZE)
            self.power(WATCHDOG | PIN)

    def patience(self):
        """After how long without food the watchdog barks, with its fastest oscillator (s)."""
        get = self.registers.get
        return (4 << get(0x4000_3004, 0)) * (get(0x4000_3008, 0xFFF) + 1) / LSI

    # Registers.

    def stops(self, problem):
        self.problem = problem
        self.uc.emu_stop()

    def waits(self, uc, *_):
        self.waiting = True
        uc.emu_stop()

    def read_bit(self, at, _):
        at -= 0x4200_0000
        return self.read(0x4000_0000 + (at >> 7 << 2), 4) >> (at >> 2 & 31) & 1

    def write_bit(self, at, _, value):
        at -= 0x4200_0000
        word, bit = 0x4000_0000 + (at >> 7 << 2), 1 << (at >> 2 & 31)
        now = self.read(word, 4)
        self.write(word, 4, now | bit if value & 1 else now & ~bit)

    def read(self, at, size):
        word = self.word(at & ~3)
        return word >> 8 * (at & 3) & (1 << 8 * size) - 1

    def word(self, at):
        value = self.registers.get(at, 0)
        if at == 0x4002_3800:  # RCC_CR: every oscillator is ready as soon as it is on
            return value | 1 | (value | 1) << 1 & 0x0202_0002 | value << 1 & 0x0202_0000
        if at == 0x4002_3808:  # RCC_CFGR: and every switch done
            return value & ~0xC | (value & 3) << 2
        if at == 0x4000_7004:  # PWR_CSR
            return value | 1 << 14
        if at == 0x4002_3C0C:  # FLASH_SR
            self.undone()
            return self.errors
        if at == 0x4002_3C14:  # FLASH_OPTCR
            return self.options
        if 0x4002_0000 <= at < 0x4002_2400 and at & 0x3FF == 0x10:  # GPIOx_IDR
            return {0: 1 << 4, 1: self.drives_off << 1 | self.sensor_bus << 6}.get(at - 0x4002_0000 >> 10, 0)
        if at == 0x4000_4400:  # USART_SR
            return 0xC0
        if at == 0x5006_0804:  # RNG_SR
            return self.registers.get(0x5006_0800, 0) >> 2 & 1
        if at == 0x5006_0808:
            return self.random.getrandbits(32)
        if at == 0x4000_300C:  # IWDG_SR: no change lasts
            return 0
        if at == 0xE000_1004:
            self.cycles += 1
            return self.cycles & 0xFFFF_FFFF
        if self.dma(at):
            stream, register = self.dma(at)
            return stream[register]
        return value

    def write(self, at, size, value):
        if size < 4:
            shift = 8 * (at & 3)
            mask = (1 << 8 * size) - 1
            value = self.word(at & ~3) & ~(mask << shift) | (value & mask) << shift
            at &= ~3
        if self.dma(at):
            stream, register = self.dma(at)
            stream[register] = value
            if register == 0 and value & 1:
                self.begin(at, stream)
            return
        if at in (0x4002_6008, 0x4002_600C, 0x4002_6408, 0x4002_640C):  # flags of DMA, which nobody waits for
            return
        if at == 0x4002_3874 and value & 1 << 24:  # RCC_CSR, RMVF
            value = 0
        elif at == 0x4002_3824 and value & 1 << 12:  # RCC_APB2RSTR, SPI1
            for register in range(0x4001_3000, 0x4001_3020, 4):
                self.registers.pop(register, None)
        elif at == 0x4000_3000:  # IWDG_KR
            if value in (0xAAAA, 0xCCCC) and (self.fed is not None or value == 0xCCCC):
                self.fed = self.time
            return
        elif at == 0x4001_3C14:  # EXTI_PR: cleared by ones
            value = self.registers.get(at, 0) & ~value
        elif at == 0x4000_0010:  # TIM2_SR: cleared by zeros
            value &= self.registers.get(at, 0)
        elif at in (0xE000_E100, 0xE000_E104):  # NVIC_ISER: set by ones
            value |= self.registers.get(at, 0)
        elif at == 0xE000_ED0C and value == 0x05FA_0004:  # AIRCR: a reset
            self.stops(Reset(SOFTWARE | PIN))
        elif 0x4002_3C00 <= at < 0x4002_3C18:
            self.flash_register(at, value)
            return
        self.registers[at] = value

    # DMA: RM0090, 10. A transfer is over as soon as it has begun, except that of the receiving line.

    def dma(self, at):
        for base in (0x4002_6000, 0x4002_6400):
            number, register = divmod(at - base - 0x10, 0x18)
            if 0 <= number < 8:
                return self.streams.setdefault((base, number), dict.fromkeys(range(0, 0x18, 4), 0)), register
        return None

    def begin(self, at, stream):
        # The ring's length, which NDTR takes again at its end.
        stream["whole"] = stream[4]
        if at == 0x4002_6010 + 6 * 0x18:  # to the host
            self.sent += self.uc.mem_read(stream[12], stream[4])
            stream[4] = 0
            stream[0] &= ~1

    def deliver(self):
        """What the host has sent goes into the ring of the receiving line."""
        stream = self.streams.get((0x4002_6000, 5))
        if stream is None or not stream[0] & 1:
            return
        # As many as arrive in a period at 115 200 baud would be 3; the host waits less with more.
        some, self.received = self.received[:256], self.received[256:]
        for byte in some:
            self.uc.mem_write(stream[12] + stream["whole"] - stream[4], bytes([byte]))
            stream[4] = stream[4] - 1 or stream["whole"]

    def exchange(self, frame):
        """A frame of the motion side, by DMA2; returns what came back."""
        into, out = self.streams.get((0x4002_6400, 2)), self.streams.get((0x4002_6400, 3))
        get = self.registers.get
        if not (into and out and into[0] & out[0] & 1 and get(0x4001_3000, 0) & 1 << 6):
            raise Wrong("a frame arrives, and SPI1 is not armed")
        if get(0x4001_3004, 0) & 3 != 3:
            raise Wrong("SPI1 has no DMA in both directions")
        answer = bytes(self.uc.mem_read(out[12], out[4]))
        self.uc.mem_write(into[12], bytes(frame[: into[4]]))
        into[4] -= min(len(frame), into[4])
        out[4] = 0
        return answer[: len(frame)]

    # Flash: RM0090, 3.

    def flash_register(self, at, value):
        now = self.registers.get(at, 0)
        if at == 0x4002_3C04:  # KEYR
            self.keys = (self.keys + [value])[-2:]
            if self.keys == [0x4567_0123, 0xCDEF_89AB]:
                self.registers[0x4002_3C10] &= ~(1 << 31)
        elif at == 0x4002_3C08:  # OPTKEYR
            self.option_keys = (self.option_keys + [value])[-2:]
            if self.option_keys == [0x0819_2A3B, 0x4C5D_6E7F]:
                self.options &= ~1
        elif at == 0x4002_3C0C:  # SR: cleared by ones
            self.errors &= ~value
        elif at == 0x4002_3C10:  # CR
            if now >> 31 and not value >> 31:
                return
            if now >> 31:
                return
            self.registers[at] = value & ~(1 << 16)
            if value & 1 << 16:
                self.erase(value)
        elif at == 0x4002_3C14:
            if not self.options & 1:
                self.options = value & ~2
        else:
            self.registers[at] = value

    def spent(self):
        """Whether the power goes during this operation."""
        self.operations += 1
        return self.cut_at is not None and self.operations >= self.cut_at

    def erase(self, control):
        number = control >> 3 & 0xF
        if not control & 2 or control & 4 or not 8 <= number <= 11:
            return self.stops(Wrong(f"erases sector {number}, control {control:#x}"))
        start, size = SECTORS[number]
        if self.spent():
            # Between old and new.
            old = self.uc.mem_read(FLASH + start, size)
            noise = self.random.randbytes(size)
            self.uc.mem_write(FLASH + start, bytes(a | b for a, b in zip(old, noise)))
            return self.stops(PowerCut())
        self.erases[number] += 1
        self.uc.mem_write(FLASH + start, b"\xff" * size)
        # Nothing runs meanwhile, not even what feeds the watchdog.
        if self.fed is not None and ERASE > self.patience():
            return self.stops(Reset(WATCHDOG | PIN))
        self.time += ERASE
        self.fed = self.fed and self.fed + ERASE

    def programmed(self, uc, _, at, size, value, *__):
        control = self.registers[0x4002_3C10]
        old = bytes(uc.mem_read(at, size))
        new = (value & (1 << 8 * size) - 1).to_bytes(size, "little")
        if control >> 31 or not control & 1:
            self.errors |= 1 << 7  # PGSERR
        elif 1 << (control >> 8 & 3) != size:
            self.errors |= 1 << 6  # PGPERR
        elif at % size or at // 16 != (at + size - 1) // 16:
            self.errors |= 1 << 5  # PGAERR
        elif at < FLASH + (512 << 10):
            return self.stops(Wrong(f"programs itself at {at:#x}"))
        elif self.refuse(at):
            self.errors |= 1 << 4  # WRPERR
        elif any(a & b != b for a, b in zip(old, new)):
            return self.stops(Wrong(f"programs {at:#x}, which is not blank"))
        elif self.spent():
            noise = self.random.randbytes(size)
            self.undo = at, bytes(a & (b | c) for a, b, c in zip(old, new, noise))
            return self.stops(PowerCut())
        else:
            return None
        # The store has still to happen, and has no effect.
        self.undo = at, old
        return None

    def undone(self):
        if self.undo:
            at, bytes_ = self.undo
            self.undo = None
            self.uc.mem_write(at, bytes_)
