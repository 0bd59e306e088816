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
    use heapless::spsc::{Consumer, Producer, Queue};
    use servo::joint::{Joint, Order, Tick};
    use servo::link::{Inbox, Incoming, refusal};
    use servo::protocol::{Command, FRAME_CAPACITY, Message, Refusal, encode};

    /// Commands on their way from the link to the control interrupt, with their sequence numbers.
    type Orders = Queue<(u16, Order), 4>;
    /// Answers on their way back; more places than orders, so none is lost, nor is the end of a commissioning.
    type Answers = Queue<Message, 8>;
    /// Telemetry records on their way to the link.
    type Records = Queue<Message, 32>;
    /// Bytes that the link takes from the line in one go; the rest waits for the next tick.
    const BYTES_AT_ONCE: usize = 2 * FRAME_CAPACITY;

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        joint: Joint,
        tick: u32,
        telemetry_every: u32,
        drive: board::Drive,
        orders_in: Consumer<'static, (u16, Order)>,
        answers_out: Producer<'static, Message>,
        records_out: Producer<'static, Message>,
        inbox: Inbox,
        sequence: u16,
        line: board::Line,
        orders_out: Producer<'static, (u16, Order)>,
        answers_in: Consumer<'static, Message>,
        records_in: Consumer<'static, Message>,
        idle: board::Idle,
    }

    #[init(local = [orders: Orders = Queue::new(), answers: Answers = Queue::new(), records: Records = Queue::new()])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let (drive, line, idle) = board::init(cx.device, cx.core);
        let (orders_out, orders_in) = cx.local.orders.split();
        let (answers_out, answers_in) = cx.local.answers.split();
        let (records_out, records_in) = cx.local.records.split();
        defmt::info!("servo {=str} on {=str}", env!("CARGO_PKG_VERSION"), board::NAME);
        let local = Local {
            joint: Joint::new(),
            tick: 0,
            telemetry_every: 0,
            drive,
            orders_in,
            answers_out,
            records_out,
            inbox: Inbox::new(),
            sequence: 0,
            line,
            orders_out,
            answers_in,
            records_in,
            idle,
        };
        (Shared {}, local)
    }

    /// One control tick. It begins when the converters have finished the measurement that the PWM timer triggered.
    #[task(binds = ADC, priority = 3,
           local = [joint, tick, telemetry_every, drive, orders_in, answers_out, records_out])]
    fn control(cx: control::Context) {
        let control::LocalResources {
            joint,
            tick,
            telemetry_every,
            drive,
            ..
        } = cx.local;
        let start = drive.clock();
        let sample = drive.sample();
        if let Some((to, order)) = cx.local.orders_in.dequeue() {
            let result = execute(joint, telemetry_every, &order);
            if let (Order::Install(axis), Ok(())) = (&order, &result) {
                drive.configure(&axis.scale().config);
            }
            // Never full: the link hands over an order only when its answer has a place.
            let _ = cx.local.answers_out.enqueue(Message::Answer {
                to,
                tick: *tick,
                result,
            });
        }
        let Tick { output, concluded } = joint.step(sample);
        drive.apply(&output);
        let cost = drive.clock_since(start);
        let (axis, tick_now, record) = (0, *tick, output.record);
        if *telemetry_every != 0 && tick_now.is_multiple_of(*telemetry_every) {
            // Full: the link is too slow for this decimation; the host sees it by the gap in the tick numbers.
            let _ = cx.local.records_out.enqueue(Message::Telemetry {
                axis,
                tick: tick_now,
                cost,
                record,
            });
        }
        if let Some(outcome) = concluded {
            let _ = cx.local.answers_out.enqueue(Message::Commissioned {
                axis,
                tick: tick_now,
                outcome,
            });
        }
        *tick = tick.wrapping_add(1);
        rtic::pend(stm32f4xx_hal::pac::Interrupt::USART2);
    }

    /// Bytes in, frames out. Runs after every tick and when a byte arrives.
    #[task(binds = USART2, priority = 2,
           local = [inbox, sequence, line, orders_out, answers_in, records_in])]
    fn link(cx: link::Context) {
        let link::LocalResources {
            inbox,
            sequence,
            line,
            orders_out,
            answers_in,
            records_in,
            ..
        } = cx.local;
        let mut send = |line: &mut board::Line, message: &Message| {
            let mut buffer = [0; FRAME_CAPACITY];
            *sequence = sequence.wrapping_add(1);
            if let Ok(bytes) = encode(*sequence, message, &mut buffer) {
                line.write(bytes);
            }
        };
        for _ in 0..BYTES_AT_ONCE {
            // One order and one answer at a time fit the queues and the line, whatever arrives.
            if !orders_out.ready() || line.room() < FRAME_CAPACITY {
                break;
            }
            let Some(byte) = line.read() else { break };
            let Some(incoming) = inbox.push(byte) else {
                continue;
            };
            let answer = match incoming {
                Incoming::Execute(to, command) => match unpack(command) {
                    Ok(order) => {
                        let _ = orders_out.enqueue((to, order));
                        continue;
                    }
                    Err(reason) => refusal(to, reason),
                },
                Incoming::Answer(answer) => answer,
                Incoming::Drop(error) => {
                    defmt::debug!("frame dropped: {}", defmt::Debug2Format(&error));
                    continue;
                }
            };
            inbox.answered(&answer);
            send(line, &answer);
        }
        while line.room() >= FRAME_CAPACITY
            && let Some(answer) = answers_in.dequeue()
        {
            inbox.answered(&answer);
            send(line, &answer);
        }
        while line.room() >= FRAME_CAPACITY
            && let Some(record) = records_in.dequeue()
        {
            send(line, &record);
        }
    }

    /// Asks the board, then builds what the control interrupt will put in place.
    fn unpack(command: Command) -> Result<Order, Refusal> {
        board::supports(&command)?;
        Order::from_command(command)
    }

    /// The subscription is the image's own; all else is the joint's.
    fn execute(joint: &mut Joint, telemetry_every: &mut u32, order: &Order) -> Result<(), Refusal> {
        match *order {
            Order::Run(Command::Subscribe { every }) => {
                *telemetry_every = every;
                Ok(())
            }
            _ => joint.execute(order),
        }
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
        defmt::error!("panic: {}", defmt::Display2Format(info));
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
