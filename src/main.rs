//! The firmware image.
//!
//! ```text
//! priority 3  control  every tick: read the encoders, step the joints, set the bridges, queue the records
//! priority 2  link     commands in, answers and telemetry out
//! priority 0  idle     the stored parameters, and the board's own business (in QEMU: the motors on the host)
//! ```
//!
//! The image for QEMU and the one for the board differ in `image/board/` alone.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod image;

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is the firmware of an STM32F405. `cargo xtask demo` builds and runs it in QEMU; `cargo flash` flashes a board."
    );
}

#[cfg(target_os = "none")]
#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use crate::image::board::{self, AXES};
    use crate::image::boot;
    use crate::image::link_task::Post;
    use crate::image::tick::{self, Control, Ends, Telemetry};
    use core::mem::MaybeUninit;
    use heapless::spsc::{Consumer, Producer, Queue};
    use servo::axis::servo_axis::{Joint, Order};
    use servo::drivers::flash::ParameterFlash;
    use servo::link::capture::{EMPTY, Ring};
    use servo::link::protocol::Message;
    use servo::store::saving::{Archive, Job, Report};

    /// Commands on their way from the link to the control interrupt, with sequence number and axis.
    type Orders = Queue<(u16, u8, Order), 2>;
    /// Answers on their way back. The link hands over an order only when it has room for what comes back, so these can
    /// wait at most: an answer and what it brings with it, two words about a save, the end of a commissioning on every
    /// axis. (A queue has one place less.)
    type Answers = Queue<Message, { AXES + 5 }>;
    /// Telemetry records on their way to the link, which runs after every tick; when it is late, its own kilobyte of
    /// frames is full.
    type Records = Queue<Telemetry, 8>;
    /// Parameters on their way from the control interrupt to the store: one axis after the other, then what to do with
    /// them. The next job waits until idle has done this one.
    type Jobs = Queue<Job, 2>;
    /// How that went.
    type Reports = Queue<Report, 2>;

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        control: Control,
        orders_in: tick::Orders,
        drive: board::Drive,
        post: Post,
        answers_in: Consumer<'static, Message>,
        records_in: Consumer<'static, Telemetry>,
        idle: board::Idle,
        archive: Archive<board::Flash, AXES>,
        jobs_in: Consumer<'static, Job>,
        reports_out: Producer<'static, Report>,
    }

    #[init(local = [ring: Ring = EMPTY, orders: Orders = Queue::new(), answers: Answers = Queue::new(),
                   joints: MaybeUninit<[Joint; AXES]> = MaybeUninit::uninit(), records: Records = Queue::new(), jobs: Jobs = Queue::new(), reports: Reports = Queue::new()])]
    fn init(mut cx: init::Context) -> (Shared, Local) {
        let cause = board::begin(&cx.device, &mut cx.core);
        let mut archive = Archive::new(ParameterFlash::new(board::flash(), board::PARAMETERS));
        let found = boot::restore(&mut archive);
        let (mut drive, line, idle) = board::init(cx.device, cx.core);
        defmt::info!("servo {=str} on {=str}", env!("CARGO_PKG_VERSION"), board::NAME);
        let joints = boot::joints(cx.local.joints, &mut archive, found, cause, &mut drive);
        let (orders_out, orders_in) = cx.local.orders.split();
        let (answers, answers_in) = cx.local.answers.split();
        let (records, records_in) = cx.local.records.split();
        let (jobs, jobs_in) = cx.local.jobs.split();
        let (reports_out, reports) = cx.local.reports.split();
        let ends = Ends {
            answers,
            records,
            jobs,
            reports,
        };
        let local = Local {
            control: Control::new(joints, cx.local.ring, cause, found, ends),
            orders_in,
            drive,
            post: Post::new(line, orders_out),
            answers_in,
            records_in,
            idle,
            archive,
            jobs_in,
            reports_out,
        };
        (Shared {}, local)
    }

    /// One control tick. It begins when the converters have finished the measurement that the PWM timer triggered.
    #[task(binds = ADC, priority = 3, local = [control, orders_in, drive])]
    fn control(cx: control::Context) {
        cx.local.control.tick(cx.local.orders_in, cx.local.drive);
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

    #[idle(local = [idle, archive, jobs_in, reports_out])]
    fn idle(cx: idle::Context) -> ! {
        let local = cx.local;
        loop {
            local.idle.turn();
            // A job holds the parameters of an axis: it is done where it lies.
            if let Some(job) = local.jobs_in.peek() {
                let report = local.idle.while_storing(|| local.archive.handle(job));
                let _ = local.jobs_in.dequeue();
                // One job is answered before the next one comes.
                report.map(|report| local.reports_out.enqueue(report));
            }
        }
    }
}
