//! The entry of an image for the STM32F405: which of the chip's interrupts run the tasks.
//!
//! Control is paced by the end of the converters' measurement, which the PWM timer triggers. The link runs when the tick
//! has pended its interrupt.

#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use crate::image::board::{Board, Selected};
    use crate::image::idle_task::IdleTask;
    use crate::image::link_task::LinkTask;
    use crate::image::start::{Places, start};
    use crate::image::tick::ControlTask;
    use stm32f4xx_hal::pac::Interrupt;

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        drive: <Selected as Board>::Drive,
        control: ControlTask,
        link: LinkTask<Selected>,
        idle: IdleTask<Selected>,
    }

    #[init(local = [places: Places = Places::new()])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let (drive, control, link, idle) = start(cx.local.places, cx.device, cx.core);
        (Shared {}, Local { drive, control, link, idle })
    }

    #[task(binds = ADC, priority = 3, local = [drive, control])]
    fn control(cx: control::Context) {
        cx.local.control.run(cx.local.drive);
        rtic::pend(Interrupt::USART2);
    }

    #[task(binds = USART2, priority = 2, local = [link])]
    fn link(cx: link::Context) {
        cx.local.link.run();
    }

    #[idle(local = [idle])]
    fn idle(cx: idle::Context) -> ! {
        cx.local.idle.run()
    }
}
