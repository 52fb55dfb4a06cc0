// The registers of the LM3S6965 that are used here, by the names of its data sheet.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_REGISTERS_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_REGISTERS_H

#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t*)(address))

// System control.
#define SYSCTL_RIS REGISTER(0x400FE050)
#define SYSCTL_RESC REGISTER(0x400FE05C)
#define SYSCTL_RCC REGISTER(0x400FE060)
#define RESC_EXTERNAL (1u << 0)
#define RESC_POWER_ON (1u << 1)
#define RESC_BROWN_OUT (1u << 2)
#define RESC_WATCHDOG (1u << 3)
#define SYSCTL_RCGC0 REGISTER(0x400FE100)
#define SYSCTL_RCGC1 REGISTER(0x400FE104)
#define SYSCTL_RCGC2 REGISTER(0x400FE108)
#define SYSCTL_USECRL REGISTER(0x400FE140)

// GPIO. Bits 2..9 of an address below DIR are a mask: the other pins of the port are left alone.
#define GPIO_A 0x40004000u
#define GPIO_B 0x40005000u
#define GPIO_C 0x40006000u
#define GPIO_D 0x40007000u
#define GPIO_E 0x40024000u
#define GPIO_F 0x40025000u
#define GPIO_G 0x40026000u
#define GPIO_DATA(port, pins) REGISTER((port) + ((pins) << 2))
#define GPIO_DIR(port) REGISTER((port) + 0x400u)
#define GPIO_IS(port) REGISTER((port) + 0x404u)
#define GPIO_IBE(port) REGISTER((port) + 0x408u)
#define GPIO_IEV(port) REGISTER((port) + 0x40Cu)
#define GPIO_IM(port) REGISTER((port) + 0x410u)
#define GPIO_MIS(port) REGISTER((port) + 0x418u)
#define GPIO_ICR(port) REGISTER((port) + 0x41Cu)
#define GPIO_AFSEL(port) REGISTER((port) + 0x420u)
#define GPIO_PUR(port) REGISTER((port) + 0x510u)
#define GPIO_DEN(port) REGISTER((port) + 0x51Cu)
#define GPIO_LOCK(port) REGISTER((port) + 0x520u)
#define GPIO_CR(port) REGISTER((port) + 0x524u)

// General-purpose timers, each as one of 32 bits.
#define TIMER(n) (0x40030000u + 0x1000u * (n))
#define TIMER_CFG(timer) REGISTER((timer) + 0x00u)
#define TIMER_TAMR(timer) REGISTER((timer) + 0x04u)
#define TIMER_CTL(timer) REGISTER((timer) + 0x0Cu)
#define TIMER_IMR(timer) REGISTER((timer) + 0x18u)
#define TIMER_RIS(timer) REGISTER((timer) + 0x1Cu)
#define TIMER_ICR(timer) REGISTER((timer) + 0x24u)
#define TIMER_TAILR(timer) REGISTER((timer) + 0x28u)
#define TIMER_ONE_SHOT 1u
#define TIMER_PERIODIC 2u

// UART 0.
#define UART_DR REGISTER(0x4000C000)
#define UART_FR REGISTER(0x4000C018)
#define UART_IBRD REGISTER(0x4000C024)
#define UART_FBRD REGISTER(0x4000C028)
#define UART_LCRH REGISTER(0x4000C02C)
#define UART_CTL REGISTER(0x4000C030)
#define UART_IM REGISTER(0x4000C038)
#define UART_FR_BUSY (1u << 3)
#define UART_FR_RXFE (1u << 4)

// Watchdog.
#define WDT_LOAD REGISTER(0x40000000)
#define WDT_CTL REGISTER(0x40000008)
#define WDT_ICR REGISTER(0x4000000C)

// ADC, its sequencer 3.
#define ADC_ACTSS REGISTER(0x40038000)
#define ADC_PSSI REGISTER(0x40038028)
#define ADC_SAC REGISTER(0x40038030)
#define ADC_SSCTL3 REGISTER(0x400380A4)
#define ADC_SSFIFO3 REGISTER(0x400380A8)
#define ADC_SSFSTAT3 REGISTER(0x400380AC)
#define ADC_SEQUENCER_3 (1u << 3)
#define ADC_SSFSTAT_EMPTY (1u << 8)

// Flash.
#define FLASH_FMA REGISTER(0x400FD000)
#define FLASH_FMD REGISTER(0x400FD004)
#define FLASH_FMC REGISTER(0x400FD008)

// Registers of the core.
#define SYST_CSR REGISTER(0xE000E010)
#define SYST_RVR REGISTER(0xE000E014)
#define SYST_CVR REGISTER(0xE000E018)
#define NVIC_ISER0 REGISTER(0xE000E100)
#define NVIC_ISER1 REGISTER(0xE000E104)
#define SCB_VTOR REGISTER(0xE000ED08)
#define SCB_AIRCR REGISTER(0xE000ED0C)

// Interrupt numbers.
#define IRQ_GPIO_A 0u
#define IRQ_UART0 5u
#define IRQ_TIMER0A 19u
#define IRQ_TIMER1A 21u
#define IRQ_TIMER2A 23u
#define IRQ_TIMER3A 35u

static inline void interrupts_off(void) {
  __asm volatile("cpsid i" ::: "memory");
}

static inline void interrupts_on(void) {
  __asm volatile("cpsie i" ::: "memory");
}

#endif
