//! The firmware image.
//!
//! ```text
//! priority 3  control  every tick: read the encoder, step the joint, set the bridge, queue the record
//! priority 2  link     commands in, answers and telemetry out
//! priority 0  idle     the board's own business (in QEMU: the exchange with the motor on the host)
//! ```
//!
//! The image for QEMU and the one for the board differ in `board/` alone.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod post;
#[cfg(target_os = "none")]
mod tick;

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is the firmware of an STM32F405. `cargo xtask demo` builds and runs it in QEMU; `cargo flash` flashes a board."
    );
}

#[cfg(target_os = "none")]
#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use crate::board;
    use crate::post::Post;
    use crate::tick::Control;
    use heapless::spsc::{Consumer, Queue};
    use servo::capture::{EMPTY, Ring};
    use servo::joint::Order;
    use servo::protocol::Message;

    /// Commands on their way from the link to the control interrupt, with their sequence numbers.
    type Orders = Queue<(u16, Order), 4>;
    /// Answers on their way back; more places than orders, so none is lost, nor is the end of a commissioning.
    type Answers = Queue<Message, 8>;
    /// Telemetry records on their way to the link.
    type Records = Queue<Message, 32>;

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        control: Control,
        drive: board::Drive,
        post: Post,
        answers_in: Consumer<'static, Message>,
        records_in: Consumer<'static, Message>,
        idle: board::Idle,
    }

    #[init(local = [ring: Ring = EMPTY, orders: Orders = Queue::new(),
                   answers: Answers = Queue::new(), records: Records = Queue::new()])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let (drive, line, idle) = board::init(cx.device, cx.core);
        let (orders_out, orders_in) = cx.local.orders.split();
        let (answers_out, answers_in) = cx.local.answers.split();
        let (records_out, records_in) = cx.local.records.split();
        defmt::info!("servo {=str} on {=str}", env!("CARGO_PKG_VERSION"), board::NAME);
        let local = Local {
            control: Control::new(cx.local.ring, orders_in, answers_out, records_out),
            drive,
            post: Post::new(line, orders_out),
            answers_in,
            records_in,
            idle,
        };
        (Shared {}, local)
    }

    /// One control tick. It begins when the converters have finished the measurement that the PWM timer triggered.
    #[task(binds = ADC, priority = 3, local = [control, drive])]
    fn control(cx: control::Context) {
        cx.local.control.tick(cx.local.drive);
        rtic::pend(stm32f4xx_hal::pac::Interrupt::USART2);
    }

    /// Bytes in, frames out. Runs after every tick and when a byte arrives.
    #[task(binds = USART2, priority = 2, local = [post, answers_in, records_in])]
    fn link(cx: link::Context) {
        let post = cx.local.post;
        post.take_commands();
        post.forward(cx.local.answers_in);
        post.forward(cx.local.records_in);
    }

    #[idle(local = [idle])]
    fn idle(cx: idle::Context) -> ! {
        loop {
            cx.local.idle.turn();
        }
    }
}

/// Anything unforeseen: first the bridge, then words.
#[cfg(target_os = "none")]
mod last_resort {
    use crate::board;
    use cortex_m_rt::{ExceptionFrame, exception};

    #[panic_handler]
    fn panic(info: &core::panic::PanicInfo) -> ! {
        board::bridge_off();
        // The place alone: the words would bring 10 KiB of formatting into the image.
        match info.location() {
            Some(place) => defmt::error!("panic at {=str}:{=u32}", place.file(), place.line()),
            None => defmt::error!("panic"),
        }
        board::halt()
    }

    #[exception]
    unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
        board::bridge_off();
        defmt::error!("hard fault at {=u32:#010x}", frame.pc());
        board::halt()
    }

    #[exception]
    unsafe fn DefaultHandler(number: i16) -> ! {
        board::bridge_off();
        defmt::error!("unexpected interrupt {=i16}", number);
        board::halt()
    }
}
