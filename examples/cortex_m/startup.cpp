// SPDX-License-Identifier: BSD-3-Clause
// From reset to main() on a Cortex-M4F or M7, and the board under QEMU: semihosting for text and exit status, SysTick for counting
// instructions, a painted stack. No vendor code, no crt0, no standard input and output of the C library, and no heap.
#include <cstddef>
#include <cstdint>

#include "examples/cortex_m/board.hpp"

extern "C" {
// From memory.ld.
extern std::uint32_t image_data_begin, image_data_end, image_bss_begin, image_bss_end, image_stack_begin, image_stack_end;
extern const std::uint32_t image_data_source;
using Constructor = void (*)();
extern Constructor image_constructors_begin[], image_constructors_end[];

int image_main() asm("main");  // C++ forbids calling main by its name
void Reset_Handler();
void Fault_Handler();
void SysTick_Handler();
}

namespace {

constexpr std::uint32_t kPaint = 0xA5C35A3CU;
constexpr int kFaultStatus = 99;
constexpr std::uint32_t kSysTickRange = 1U << 24,
                        kInstructionsPerTick = 40;  // SysTick at 25 MHz; -icount shift=0: one instruction a nanosecond

volatile std::uint32_t systick_wraps = 0;

volatile std::uint32_t& device_register(std::uintptr_t address) { return *reinterpret_cast<volatile std::uint32_t*>(address); }
constexpr std::uintptr_t kSysTickControl = 0xE000E010, kSysTickReload = 0xE000E014, kSysTickCurrent = 0xE000E018,
                         kCoprocessorAccess = 0xE000ED88;

/// A call of the debugger: operation in r0, its argument in r1, answer in r0.
std::uintptr_t semihost(std::uintptr_t operation, const void* argument) {
  register std::uintptr_t r0 asm("r0") = operation;
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

constexpr std::uintptr_t kOpen = 0x01, kWrite = 0x05, kWriteText = 0x04, kExitExtended = 0x20;  // ARM semihosting, release 2.0

[[noreturn]] void leave(int status) {
  const std::uintptr_t block[] = {0x20026 /* application exit */, static_cast<std::uintptr_t>(status)};  // plain SYS_EXIT carries no status
  (void)semihost(kExitExtended, block);
  for (;;) asm volatile("wfi");
}

/// Kept out of line: everything in Reset_Handler stands above it on the stack.
__attribute__((noinline)) void start_memory() {
  const std::uint32_t* from = &image_data_source;
  for (std::uint32_t* p = &image_data_begin; p != &image_data_end; ++p) *p = *from++;
  for (std::uint32_t* p = &image_bss_begin; p != &image_bss_end; ++p) *p = 0;
  std::uint32_t* const here = reinterpret_cast<std::uint32_t*>(__builtin_frame_address(0)) - 64;
  for (std::uint32_t* p = &image_stack_begin; p < here; ++p) *p = kPaint;
}

}  // namespace

namespace searvins::cortex_m {

void write(const char* text) {
  static std::uintptr_t console = 0;
  if (console == 0) {
    const std::uintptr_t block[] = {reinterpret_cast<std::uintptr_t>(":tt"), 4 /* "w": standard output */, 3};
    console = semihost(kOpen, block);
  }
  std::size_t length = 0;
  while (text[length] != 0) ++length;
  const std::uintptr_t block[] = {console, reinterpret_cast<std::uintptr_t>(text), length};
  (void)semihost(kWrite, block);
}

std::uint64_t instructions() {
  for (;;) {
    const std::uint32_t wraps = systick_wraps, ticks = kSysTickRange - 1 - device_register(kSysTickCurrent);
    if (wraps == systick_wraps) return (std::uint64_t{wraps} * kSysTickRange + ticks) * kInstructionsPerTick;
  }
}

std::uint32_t stack_high_water() {
  const std::uint32_t* p = &image_stack_begin;
  while (p != &image_stack_end && *p == kPaint) ++p;
  return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(&image_stack_end) - reinterpret_cast<std::uintptr_t>(p));
}

}  // namespace searvins::cortex_m

extern "C" {

void SysTick_Handler() { systick_wraps = systick_wraps + 1; }

[[noreturn]] __attribute__((used)) void report_fault() {
  (void)semihost(kWriteText, "FAULT: stack overflow, bad address, or a failed eigen_assert\n");
  leave(kFaultStatus);
}

/// The stack may be what is broken: begin it anew before any C++ runs.
__attribute__((naked, used)) void Fault_Handler() { asm volatile("ldr sp, =image_stack_end\n b report_fault"); }

__attribute__((used)) void Reset_Handler() {
  device_register(kCoprocessorAccess) = device_register(kCoprocessorAccess) | 0xFU << 20;  // the floating-point unit, for everyone
  asm volatile("dsb\n isb");
  start_memory();
  device_register(kSysTickReload) = kSysTickRange - 1;
  device_register(kSysTickCurrent) = 0;
  device_register(kSysTickControl) = 7;  // core clock, interrupt, on
  for (Constructor* c = image_constructors_begin; c != image_constructors_end; ++c) (*c)();
  leave(image_main());
}

// What the C++ runtime asks for where crtbegin.o and a C library's exit() would be. Nothing is ever destroyed.
void* __dso_handle = nullptr;
int __aeabi_atexit(void*, void (*)(void*), void*) { return 0; }
[[noreturn]] void abort() { Fault_Handler(), leave(kFaultStatus); }

__attribute__((section(".vectors"), used)) extern const std::uintptr_t vector_table[16] = {
    reinterpret_cast<std::uintptr_t>(&image_stack_end),
    reinterpret_cast<std::uintptr_t>(&Reset_Handler),
    reinterpret_cast<std::uintptr_t>(&Fault_Handler),  // NMI
    reinterpret_cast<std::uintptr_t>(&Fault_Handler),  // HardFault
    reinterpret_cast<std::uintptr_t>(&Fault_Handler),  // MemManage
    reinterpret_cast<std::uintptr_t>(&Fault_Handler),  // BusFault
    reinterpret_cast<std::uintptr_t>(&Fault_Handler),  // UsageFault
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    0,
    reinterpret_cast<std::uintptr_t>(&SysTick_Handler)};

}  // extern "C"
