//! A board with its motors: the chip's code of one board on the bench.

use super::chip::Drive;
use super::chip::stm32f405::board::Board;
use super::chip::stm32f405::clock;
use super::chip::stm32f405::drive::{DriveOf, SETTLING};
use super::chip::stm32f405::gates::Supervised;
use super::chip::stm32f405::pac::Peripherals;
use crate::board_model::machine::Chip;
use crate::board_model::motor::{Leg, Motor};
use crate::board_model::trap::Bench;
use crate::board_model::wires::Wires;
use servo::axis::servo_axis::{Order, ServoAxis};
use servo::axis::{Bridge, Command, Output};
use servo::commission::Outcome;
use servo::drivers::gates::Event;
use servo::protect::{Condition, Interlock};

/// Clocks of a tick of 10 kHz, and of the work of one axis.
pub const TICK: u64 = 16_800;
pub const WORK: u64 = 1_700;

/// The board with its motors.
pub struct Rig<const N: usize> {
    pub bench: Bench,
    pub drive: DriveOf<N>,
    gates: Supervised,
    /// What gate drivers had to tell.
    pub told: Vec<Event>,
    /// How the last commissioning of each axis has ended.
    pub concluded: [Option<Outcome>; N],
    /// Idle has taken longer than a tick, which would have interrupted it on the chip.
    held_up: bool,
}

impl<const N: usize> Rig<N> {
    pub fn new(board: &'static Board, wires: Wires, late: bool) -> Self {
        Self::prepared(board, wires, late, |_| {})
    }

    /// `prepare`: the chip before power-up.
    pub fn prepared(
        board: &'static Board,
        wires: Wires,
        late: bool,
        prepare: impl FnOnce(&mut Chip),
    ) -> Self {
        let mut chip = Chip::new(vec![Motor::default(); N], wires, late);
        prepare(&mut chip);
        let bench = Bench::new(chip);
        // SAFETY: the bench gives one test at a time the addresses of the chip.
        let device = unsafe { Peripherals::steal() };
        clock::enable_peripherals(&device.RCC, board);
        let drive = DriveOf::prepare(&device.ADC_COMMON, device.ADC1, &device.ADC2, board, SETTLING);
        let mut told = Vec::new();
        let gates = Supervised::start(|event| told.push(event));
        drive.go();
        let mut rig = Self { bench, drive, gates, told, concluded: [None; N], held_up: false };
        // Drivers wake up, the phase of the update is found, and every axis asks for an open bridge.
        (0..=SETTLING).for_each(|_| rig.tick([(Bridge::Open, 0); N]));
        rig
    }

    /// One tick in which every axis takes its time.
    pub fn tick(&mut self, wanted: [(Bridge, i16); N]) {
        self.begin();
        for (axis, (bridge, duty)) in wanted.into_iter().enumerate() {
            self.bench.chip(|chip| chip.run(WORK));
            self.drive.set(axis, bridge, duty);
        }
        assert!(!self.drive.end_tick() || self.held_up, "the tick was too long");
        self.idle();
    }

    fn idle(&mut self) {
        let begin = self.bench.chip(|chip| chip.now);
        self.told.extend(self.gates.turn());
        self.held_up = self.bench.chip(|chip| chip.now) - begin > TICK / 4;
    }

    pub fn begin(&mut self) {
        self.bench.chip(Chip::run_to_tick);
        self.drive.begin_tick();
    }

    /// Lets the last command act, and records what the legs do for two ticks.
    pub fn record(&mut self, wanted: [(Bridge, i16); N]) -> Vec<(u64, Vec<[Leg; 2]>)> {
        self.tick(wanted);
        self.begin();
        let edges = self.bench.chip(|chip| {
            chip.watch();
            chip.run(2 * TICK);
            let last = chip.edges.last().expect("levels").1.clone();
            chip.edges.push((chip.now, last));
            chip.edges.clone()
        });
        // Ticks were lost meanwhile.
        self.begin();
        edges
    }

    pub fn legs(&self) -> Vec<[Leg; 2]> {
        self.bench.chip(|chip| chip.edges.last().expect("levels").1.clone())
    }

    /// One tick as the image makes it: the outputs of all axes.
    pub fn image_tick(&mut self, axes: &mut [ServoAxis; N]) -> [Output; N] {
        self.begin();
        let outputs = std::array::from_fn(|number| {
            self.bench.chip(|chip| chip.run(WORK));
            let (axis, sample) = (&mut axes[number], self.drive.sample(number));
            let interlock = self.drive.interlock(number);
            if interlock != Interlock::Granted {
                axis.raise(Condition::Interlock(interlock));
            }
            let tick = axis.step(sample);
            let output = tick.output;
            self.concluded[number] = tick.concluded.copied().or(self.concluded[number]);
            self.drive.apply(number, output.bridge, output.duty);
            output
        });
        self.idle();
        outputs
    }
}

pub fn order(axis: &mut ServoAxis, command: Command) {
    axis.execute(&Order::Run(command)).unwrap_or_else(|error| panic!("{command:?}: {error:?}"));
}
