//! A small geared motor, just good enough to excite what is counted: first order, Coulomb friction, an encoder.

/// No-load speed at full voltage, counts per second.
const FULL_SPEED: f32 = 70_000.0;
/// Time constant, s.
const TAU: f32 = 0.04;
/// Friction, share of the nominal supply.
const DEAD_ZONE: f32 = 0.1;
/// Share of the nominal supply beyond which the motor does not follow.
const KNEE: f32 = 0.85;

#[derive(Default)]
pub struct Motor {
    /// Counts per second.
    speed: f32,
    /// Counts and their fraction.
    count: i32,
    part: f32,
}

impl Motor {
    /// `voltage`: share of the nominal supply; `None`: bridge open.
    pub fn pass(&mut self, voltage: Option<f32>, seconds: f32) {
        let share = seconds / TAU;
        let driven = voltage.map_or(self.speed / FULL_SPEED, |v| v.clamp(-KNEE, KNEE));
        let resting = self.speed == 0.0 && driven.abs() <= DEAD_ZONE;
        let side = if self.speed != 0.0 { self.speed } else { driven };
        let friction = if side < 0.0 { -DEAD_ZONE } else { DEAD_ZONE };
        let pull = if resting { 0.0 } else { FULL_SPEED * (driven - friction) - self.speed };
        let next = self.speed + pull * share;
        self.speed = if self.speed * next < 0.0 { 0.0 } else { next };
        self.part += self.speed * seconds;
        let whole = self.part as i32;
        self.part -= whole as f32;
        self.count = self.count.wrapping_add(whole);
    }

    pub fn count(&self) -> i32 {
        self.count
    }
}
