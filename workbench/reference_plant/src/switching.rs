//! Where a piece of the equations ends, and which follows.
//!
//! Each switching has a guard: a quantity that is positive while its piece holds. The first guard to reach zero ends the
//! piece.

use super::drive::{Command, Decay, Knee, Piece};
use super::modes::{Contact, GUARDS, Held, Modes, Motion, Winding};
use super::motor::{Motor, Train};
use super::rosenbrock::State;
use super::state::*;
use servo::axis::Bridge;

impl Modes {
    /// Guards of all switchings, positive while these modes hold.
    pub fn guards(&self, motor: &Motor, held: &Held, t: f64, y: &State) -> [f64; GUARDS] {
        [
            self.dead_zone_guard(motor, held, y),
            self.limit_guard(motor, held, y),
            self.winding_guard(motor, held, y),
            self.motion_guard(0, motor, held, t, y),
            self.motion_guard(1, motor, held, t, y),
            self.contact_guard(motor, y),
        ]
    }

    fn dead_zone_guard(&self, motor: &Motor, held: &Held, y: &State) -> f64 {
        let drive = &motor.drive;
        if drive.dead_zone_v == [0.0; 2]
            || !chain_varies(motor, held)
            || matches!(drive.dead_zone_knee, Knee::Logistic(_))
        {
            return f64::INFINITY;
        }
        self.dead_zone.margin(motor.before_dead_zone(held, y), drive.dead_zone_v)
    }

    fn limit_guard(&self, motor: &Motor, held: &Held, y: &State) -> f64 {
        let drive = &motor.drive;
        if drive.limit_v == [f64::INFINITY; 2] || !chain_varies(motor, held) || drive.limit_knee != Knee::Hard
        {
            return f64::INFINITY;
        }
        let x = drive.behind_dead_zone(motor.before_dead_zone(held, y), self.dead_zone);
        self.limit.margin(x, drive.limit_v)
    }

    fn winding_guard(&self, motor: &Motor, held: &Held, y: &State) -> f64 {
        let limit = motor.drive.current_limit_a;
        let current = y[CURRENT];
        match self.winding {
            Winding::Off => f64::INFINITY,
            Winding::Free => limit - current.abs(),
            Winding::Signed(sign) => (limit - current.abs()).min(sign * current),
            Winding::Diode(sign) => sign * current,
            Winding::Blocked => motor.drive.drop_v - self.net_voltage(motor, held, y).abs(),
            Winding::Limited(sign) => self.excess_voltage(sign, motor, held, y),
        }
    }

    /// Offered voltage minus back-EMF.
    fn net_voltage(&self, motor: &Motor, held: &Held, y: &State) -> f64 {
        motor.offered(held, self, y) - motor.emf_constant * y[SPEED]
    }

    /// Voltage beyond what holds the current at its limit.
    fn excess_voltage(&self, sign: f64, motor: &Motor, held: &Held, y: &State) -> f64 {
        let rise = motor.thermal.map_or(1.0, |thermal| 1.0 + thermal.rise_per_w * y[HEAT]);
        let holding = motor.resistance_ohm * rise * motor.drive.current_limit_a + motor.drive.drop_v;
        sign * self.net_voltage(motor, held, y) - holding
    }

    fn motion_guard(&self, index: usize, motor: &Motor, held: &Held, t: f64, y: &State) -> f64 {
        let omega = y[[SPEED, LOAD_SPEED][index]];
        match self.motion[index] {
            Motion::Free => f64::INFINITY,
            Motion::Forward => omega,
            Motion::Backward => -omega,
            Motion::Stuck if index == 1 && !motor.has_two_bodies() => f64::INFINITY,
            Motion::Stuck => self.holding_margin(index, motor, held, t, y).0,
        }
    }

    /// Torque that sticking could still hold, and whether the shaft is pushed forward.
    fn holding_margin(&self, index: usize, motor: &Motor, held: &Held, t: f64, y: &State) -> (f64, bool) {
        let friction = [&motor.friction, &motor.load_friction][index];
        let theta = y[[ANGLE, LOAD_ANGLE][index]];
        let driving = motor.driving_torque(index, held, self, t, y);
        let forward = driving.total >= 0.0;
        (friction.level(forward, 0.0, theta, driving.motor, driving.load) - driving.total.abs(), forward)
    }

    fn contact_guard(&self, motor: &Motor, y: &State) -> f64 {
        let Train::Play { gap_rad, stiffness, damping, .. } = motor.train else {
            return f64::INFINITY;
        };
        let twist = y[ANGLE] - y[LOAD_ANGLE];
        // Damping as a penetration: what the spring must give for the teeth to part.
        let pull = damping / stiffness * (y[SPEED] - y[LOAD_SPEED]);
        let (ahead, behind) = (twist - 0.5 * gap_rad, -twist - 0.5 * gap_rad);
        match self.contact {
            Contact::Bonded => f64::INFINITY,
            // Parting teeth may still overlap by what the damping held back.
            Contact::Free => (-ahead + (-pull).max(0.0)).min(-behind + pull.max(0.0)),
            Contact::Ahead => ahead + pull,
            Contact::Behind => behind - pull,
        }
    }

    /// Enters the piece that follows once guard `which` has run out. States that stop are set to rest exactly.
    pub fn switch(&mut self, which: usize, motor: &Motor, held: &Held, t: f64, y: &mut State) {
        match which {
            0 | 1 => self.place_in_chain(motor, held, y),
            2 => self.switch_winding(motor, held, y),
            3 | 4 => self.switch_motion(which - 3, motor, held, t, y),
            _ => self.switch_contact(y),
        }
    }

    /// Finds the modes anew after an input has jumped.
    pub fn settle(&mut self, motor: &Motor, held: &Held, t: f64, y: &mut State) {
        self.place_in_chain(motor, held, y);
        self.settle_winding(motor, held, y);
        for index in 0..1 + usize::from(motor.has_two_bodies()) {
            if !motor.depends_on_direction(index) {
                self.motion[index] = Motion::Free;
            } else if y[[SPEED, LOAD_SPEED][index]] == 0.0 {
                self.start_from_rest(index, motor, held, t, y);
            }
        }
    }

    fn place_in_chain(&mut self, motor: &Motor, held: &Held, y: &State) {
        let drive = &motor.drive;
        let x = motor.before_dead_zone(held, y);
        self.dead_zone = Piece::of(x, drive.dead_zone_v);
        self.limit = Piece::of(drive.behind_dead_zone(x, self.dead_zone), drive.limit_v);
    }

    fn settle_winding(&mut self, motor: &Motor, held: &Held, y: &mut State) {
        let off_time = matches!(motor.drive.decay, Decay::Fast { .. }) && held.full_on.is_none();
        if held.bridge == Bridge::Open || matches!(held.command, Command::Torque(_)) {
            y[CURRENT] = 0.0;
            self.winding = Winding::Off;
        } else if held.bridge == Bridge::Driven && off_time {
            self.winding = if y[CURRENT] == 0.0 { Winding::Off } else { Winding::Diode(y[CURRENT].signum()) };
        } else if y[CURRENT].abs() >= motor.drive.current_limit_a
            && self.excess_voltage(y[CURRENT].signum(), motor, held, y) > 0.0
        {
            self.winding = Winding::Limited(y[CURRENT].signum());
        } else {
            self.conduct(motor, held, y);
        }
    }

    /// Current flows by its sign, or starts from zero.
    fn conduct(&mut self, motor: &Motor, held: &Held, y: &State) {
        let net = self.net_voltage(motor, held, y);
        self.winding = if motor.drive.drop_v == 0.0 {
            Winding::Free
        } else if y[CURRENT] != 0.0 {
            Winding::Signed(y[CURRENT].signum())
        } else if net.abs() > motor.drive.drop_v {
            Winding::Signed(net.signum())
        } else {
            Winding::Blocked
        };
    }

    fn switch_winding(&mut self, motor: &Motor, held: &Held, y: &mut State) {
        let limit = motor.drive.current_limit_a;
        match self.winding {
            Winding::Free | Winding::Signed(_) if y[CURRENT].abs() >= limit => {
                y[CURRENT] = limit.copysign(y[CURRENT]);
                self.winding = Winding::Limited(y[CURRENT].signum());
            }
            Winding::Signed(_) => {
                y[CURRENT] = 0.0;
                self.conduct(motor, held, y);
            }
            Winding::Diode(_) => {
                y[CURRENT] = 0.0;
                self.winding = Winding::Off;
            }
            Winding::Limited(_) | Winding::Blocked | Winding::Free | Winding::Off => {
                self.conduct(motor, held, y)
            }
        }
    }

    fn switch_motion(&mut self, index: usize, motor: &Motor, held: &Held, t: f64, y: &mut State) {
        y[[SPEED, LOAD_SPEED][index]] = 0.0;
        self.start_from_rest(index, motor, held, t, y);
    }

    /// Stuck, or off in the direction of the torque.
    fn start_from_rest(&mut self, index: usize, motor: &Motor, held: &Held, t: f64, y: &State) {
        self.motion[index] = Motion::Stuck;
        let (margin, forward) = self.holding_margin(index, motor, held, t, y);
        let bristle = [&motor.friction, &motor.load_friction][index].bristle;
        if bristle.is_none() && margin >= 0.0 {
            return;
        }
        self.motion[index] = if forward { Motion::Forward } else { Motion::Backward };
        if bristle.is_some() {
            // Bristles always give way: the direction is that of the net torque, their spring included.
            let rate = motor.rates(held, self, t, y)[SPEED];
            self.motion[index] = if rate >= 0.0 { Motion::Forward } else { Motion::Backward };
        }
    }

    fn switch_contact(&mut self, y: &State) {
        self.contact = match self.contact {
            Contact::Free if y[ANGLE] > y[LOAD_ANGLE] => Contact::Ahead,
            Contact::Free => Contact::Behind,
            Contact::Ahead | Contact::Behind => Contact::Free,
            Contact::Bonded => Contact::Bonded,
        };
    }
}

/// True if the voltage in front of the dead zone moves between breaks in time.
fn chain_varies(motor: &Motor, held: &Held) -> bool {
    let sags = motor.drive.source_ohm > 0.0 && matches!(held.command, Command::Duty(_));
    held.bridge == Bridge::Driven && held.full_on.is_none() && (sags || motor.drive.lag_s > 0.0)
}
