//! From power-up to three tasks, on any board.

use super::board::{AXES, Board};
use super::boot;
use super::idle_task::IdleTask;
use super::link_task::{Link, LinkTask, Parcels};
use super::tick::{Control, ControlTask, Ends, Order, Orders, Parcel, Telemetry};
use core::mem::MaybeUninit;
use cortex_m::Peripherals as CorePeripherals;
use fast_tick::ServoAxis;
use fast_tick::constants::{self, Place};
use heapless::spsc::Queue;
use servo::drivers::flash::ParameterFlash;
use servo::drivers::saving::{Archive, Job, Report};
use servo::link::capture::{EMPTY, Ring};
use servo::link::in_force::InForce;
use servo::link::protocol::{Command, Message};
use servo::store::MAX_AXES;

const _: () = assert!(AXES <= MAX_AXES, "a stored record has no room for that many axes");

/// Memory that the tasks share, or that is too large for the stack. It stays where it is for the life of the program.
pub struct Places {
    ring: Ring,
    axes: [MaybeUninit<ServoAxis>; AXES],
    /// The constants in force, and one place for those that the link prepares.
    constants: [Place; AXES + 1],
    /// A command on its way from the link to the control interrupt, which reads it where it lies; the place itself goes round.
    parcel: MaybeUninit<Parcel>,
    filled: Queue<&'static mut Parcel, 2>,
    empty: Queue<&'static mut Parcel, 2>,
    /// Answers on their way back. The link hands over an order only when it has room for what comes back, so at most these
    /// wait: an answer and what it brings with it, two messages about a save, and the end of a commissioning on every axis.
    /// (A queue has one place less than its number.)
    answers: Queue<Message, { AXES + 5 }>,
    /// Telemetry records on their way to the link. The link runs after every tick; it is late only when its own kilobyte of
    /// frames is full.
    records: Queue<Telemetry, 8>,
    /// Parameters on their way from the control interrupt to the store: one axis after the other, then what to do with
    /// them. The next job waits until idle has done this one.
    jobs: Queue<Job, 2>,
    /// How each job went, on the way back.
    reports: Queue<Report, 2>,
}

impl Places {
    /// Places with nothing in them.
    pub const fn new() -> Self {
        Places {
            ring: EMPTY,
            axes: [const { MaybeUninit::uninit() }; AXES],
            constants: [const { Place::new() }; AXES + 1],
            parcel: MaybeUninit::uninit(),
            filled: Queue::new(),
            empty: Queue::new(),
            answers: Queue::new(),
            records: Queue::new(),
            jobs: Queue::new(),
            reports: Queue::new(),
        }
    }
}

/// Starts the board and makes the tasks of the image. The drive stands beside the control task, not in it: putting it there
/// would copy it on the stack, which is deepest here.
pub fn start<B: Board>(
    places: &'static mut Places,
    device: B::Device,
    mut core: CorePeripherals,
) -> (B::Drive, ControlTask, LinkTask<B>, IdleTask<B>) {
    let started = B::begin(&device, &mut core);
    let mut archive = Archive::new(ParameterFlash::new(B::flash(), B::PARAMETERS));
    let found = boot::restore::<B>(&mut archive);
    let (mut drive, line, idle) = B::init(device, core);
    defmt::info!("servo {=str} on {=str}", env!("CARGO_PKG_VERSION"), B::NAME);
    places.constants.iter_mut().for_each(constants::add);
    let axes = boot::axes::<B>(&mut places.axes, &mut archive, found, started.cause, &mut drive);
    let in_force = InForce::new(axes.each_ref().map(|axis| axis.in_force().cloned()));
    let (filled, waiting) = places.filled.split();
    let (mut done, empty) = places.empty.split();
    let parcel =
        places.parcel.write(Parcel { to: 0, axis: 0, order: Order::Run(Command::Hello), done: false });
    let _ = done.enqueue(parcel);
    let (answers, answers_in) = places.answers.split();
    let (records, records_in) = places.records.split();
    let (jobs, jobs_in) = places.jobs.split();
    let (reports_out, reports) = places.reports.split();
    let ends = Ends { answers, records, jobs, reports };
    let control = Control::new(axes, &mut places.ring, started, found, ends, &drive);
    (
        drive,
        ControlTask::new(control, Orders { waiting, done }),
        LinkTask::new(Link::new(line, Parcels { empty, filled }, in_force), answers_in, records_in),
        IdleTask::new(idle, archive, jobs_in, reports_out),
    )
}
