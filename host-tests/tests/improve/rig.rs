//! A motor with hidden effects behind the servo's library, and jobs for the loop.

use servo::config::Config;
use servo::identify::estimate::{Estimate, Estimates, GAIN_FRAC, Standing, TIME_FRAC};
use servo::optional::Optional;
use servo::store::AxisParameters;
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use trials::host_servo::{HostServo, Outside};
use truing::device::link::Wire;
use truing::device::motor::Builtin;
use truing::device::session::Listening;
use truing::device::setup::Setup;
use truing::improve::bench::Bench;
use truing::improve::candidate;
use truing::improve::improving::{self, Improved, Job};
use truing::system::model::{self, Model};
use truing::text::input_error::InputError;

/// A small gear motor at a control rate that runs fast on a host.
pub fn config() -> Config {
    Config {
        tick_hz: 1000,
        rated_speed_rad_s: 110.0,
        vbus_v_per_lsb: 0.005,
        time_constant_hint_s: Optional::new(0.08),
        ..Config::EXAMPLE
    }
}

/// 10 rad/s per volt, 0.1 s, with these tables.
pub fn motor(effects: &str) -> Model {
    model::parse("motor.toml", &text(effects)).expect("a model")
}

/// The same as a file.
pub fn text(effects: &str) -> String {
    format!(
        "schema = \"truing-model/1\"\n[model]\nkind = \"dc_motor\"\n[motor]\nR_ohm = 2.0\nL_h = 0.0005\nKt_nm_per_a = 0.09\n\
         Ke_vs_per_rad = 0.09\nJ_kgm2 = 0.0004\nb_nms_per_rad = 0.0002\n[supply]\nnominal_v = 12.0\nlimit_v = 12.0\n\
         [encoder]\ncounts_per_rev = 2048\nside = \"motor\"\n{effects}"
    )
}

/// A dead zone that the servo does not know.
pub const DEAD_ZONE: &str = "[known.dead_zone]\nhalf_width_v = 1.2\n";

/// Power-up with this motor.
pub fn power_up(effects: &str, outside: &Outside) -> HostServo {
    let motor = Builtin::new(&motor(effects), &config(), 3);
    HostServo::power_up(Box::new(motor), config(), outside)
}

/// A servo that outlives the commands of its host.
#[derive(Clone)]
pub struct Held {
    servo: Rc<RefCell<HostServo>>,
    outside: Outside,
    folder: Rc<RefCell<Option<(u32, PathBuf)>>>,
}

impl Held {
    /// A servo, and what it leaves outside.
    pub fn new(servo: HostServo, outside: &Outside) -> Self {
        Self { servo: Rc::new(RefCell::new(servo)), outside: outside.clone(), folder: Rc::default() }
    }

    /// At this tick the folder of results disappears.
    pub fn loses_folder(&self, tick: u32, folder: &Path) {
        self.folder.replace(Some((tick, folder.to_owned())));
    }
}

impl Wire for Held {
    fn turn(&mut self, outgoing: &mut Vec<u8>, incoming: &mut Vec<u8>) -> Result<(), InputError> {
        let due = |(tick, _): &mut (u32, PathBuf)| *tick <= self.outside.ticks.get();
        if let Some((_, folder)) = self.folder.borrow_mut().take_if(due) {
            std::fs::remove_dir_all(&folder).expect("the folder was there");
            std::fs::write(folder, "").expect("a file in its place");
        }
        self.servo.borrow_mut().turn(outgoing, incoming)
    }
}

/// A bench with this servo.
pub fn bench(wire: impl Wire + 'static) -> Bench {
    Bench::new(Box::new(wire), Listening { axis: 0, every: 1 })
}

/// A job for the loop.
pub fn job(model: Option<Model>, out: &Path) -> Job {
    Job {
        setup: config().into(),
        model,
        out: out.to_owned(),
        budget_s: 60.0,
        seed: 1,
        analyse: Box::new(candidate::analysed),
    }
}

/// Runs the loop on a motor with these effects; what is stored stays in `outside`.
pub fn improved(effects: &str, model: Option<Model>, outside: &Outside, out: &Path) -> Improved {
    let mut told = |text: &str| println!("{text}");
    improving::run(bench(power_up(effects, outside)), job(model, out), &mut told)
        .expect("a servo that answers")
}

/// A set as text: one bit that differs shows.
pub fn bits(set: Option<AxisParameters>) -> String {
    serde_json::to_string(&set).expect("a set")
}

/// What a commissioning without error would know of the linear motor.
pub fn linear() -> AxisParameters {
    let known = motor("").physics();
    let config = config();
    let trusted = |value: f64| Estimate { value: value as i32, u95: 0, standing: Standing::Trusted };
    let nominal = f64::from(config.supply_nominal_v) / f64::from(config.rated_speed_rad_s);
    let estimates = Estimates {
        gain: trusted(known.dc_gain() * nominal * f64::from(1u32 << GAIN_FRAC)),
        time_constant: trusted(
            known.time_constant_s() * f64::from(config.tick_hz) * f64::from(1u32 << TIME_FRAC),
        ),
        ..Estimates::default()
    };
    AxisParameters { estimates, ..Setup::from(config).parameters(None) }
}
