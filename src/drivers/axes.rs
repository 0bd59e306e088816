//! All axes of one chip: sensors in at the beginning of a tick, bridges out at its end.
//!
//! One moment counts for all axes: [`Axes::begin_tick`] reads their counts, index lines, converters, fault and enable lines
//! and breakers, before any of them computes. What an axis is asked later is what was read then.
//!
//! ```text
//! fault line ──> breaker: outputs off, in hardware ──> begin_tick: every axis of the breaker is told
//!                                                      apply:      every one of them is held open
//!                                                      begin_tick: all are open, so the breaker is cleared
//! ```
//!
//! A breaker is cleared when the axes behind it have been open for a tick, because compare registers are loaded once a
//! tick: outputs that followed earlier would drive on what was written before the fault. An axis drives again when it has
//! itself asked for an open bridge since.

use super::axis::GuardedAxis;
use super::bridge::HBridge;
use super::parts::{Breaker, Parts};
use crate::axis::{Bridge, Sample};
use crate::protect::Interlock;
use heapless::Vec;

/// `N` axes and what switches their bridges off.
pub struct Axes<P: Parts, const N: usize> {
    axes: [GuardedAxis<P>; N],
    groups: Vec<Group<P::Breaker>, N>,
    /// Ticks in which no bridge is driven yet and breakers are only cleared.
    settling: u8,
}

/// The axes behind one breaker.
struct Group<B> {
    breaker: B,
    /// It had tripped when this tick began, and its axes know.
    told: bool,
}

impl<P: Parts, const N: usize> Axes<P, N> {
    /// Takes axes with open bridges. Axis n is behind breaker n / `sharing`. For `settling` ticks drivers wake up, which
    /// they may report as a fault, and fault lines rise: that is forgotten, and until then no bridge is driven.
    ///
    /// There are at most as many breakers as axes; more are left out.
    pub fn new(
        axes: [GuardedAxis<P>; N],
        breakers: impl IntoIterator<Item = P::Breaker>,
        settling: u8,
    ) -> Self {
        let groups = breakers.into_iter().take(N).map(|breaker| Group { breaker, told: false }).collect();
        Self { axes, groups, settling }
    }

    /// Looks at everything once. To be called first in a tick.
    pub fn begin_tick(&mut self) {
        // The counts move: they come first, one right after the other.
        self.axes.iter_mut().for_each(GuardedAxis::latch_count);
        self.latch_converters();
        if let Some(left) = self.settling.checked_sub(1) {
            self.settling = left;
            self.groups.iter_mut().for_each(|group| group.breaker.clear());
        }
        // In the tick that permits driving the lines have been looked at.
        if self.settling == 0 {
            self.judge();
        }
        self.enable();
    }

    fn latch_converters(&mut self) {
        for axis in &mut self.axes {
            let group = self.groups.get(axis.breaker());
            axis.latch_converters(group.is_none_or(|group| group.breaker.measures()));
        }
    }

    fn judge(&mut self) {
        for (number, group) in self.groups.iter_mut().enumerate() {
            let mut behind = self.axes.iter_mut().filter(|axis| axis.breaker() == number);
            group.look(behind.by_ref().all(|axis| axis.is_open()));
        }
        for axis in &mut self.axes {
            let group = self.groups.get(axis.breaker());
            axis.judge(group.is_some_and(|group| group.told));
        }
    }

    /// Outputs follow where every axis behind the breaker is open and permitted.
    fn enable(&mut self) {
        for (number, group) in self.groups.iter_mut().enumerate() {
            let mut behind = self.axes.iter().filter(|axis| axis.breaker() == number);
            if behind.all(|axis| axis.is_open() && axis.permission() == Interlock::Granted) {
                group.breaker.enable();
            }
        }
    }

    /// What was read when the tick began.
    pub fn sample(&self, axis: usize) -> Sample {
        self.axes.get(axis).map_or(Sample::NONE, GuardedAxis::sample)
    }

    /// Zeros of the current, as [`super::sense::CurrentSensor::zeros`] has them.
    pub fn zeros(&self, axis: usize) -> [i16; 2] {
        self.axes.get(axis).map_or([Sample::CURRENT_NOT_SENSED; 2], GuardedAxis::zeros)
    }

    /// Can the counter of this axis go round unseen while nobody reads it for seconds?
    pub fn goes_round(&self, axis: usize) -> bool {
        self.axes.get(axis).is_some_and(GuardedAxis::goes_round)
    }

    /// What fault line, breaker and enable contact said when the tick began.
    pub fn interlock(&self, axis: usize) -> Interlock {
        self.axes.get(axis).map_or(Interlock::Disabled, GuardedAxis::permission)
    }

    /// Was the index line high when the count was read?
    pub fn index(&self, axis: usize) -> bool {
        self.axes.get(axis).is_some_and(GuardedAxis::index)
    }

    /// Sets the bridge of an axis as the axis wants it, if its lines permit.
    pub fn apply(&mut self, axis: usize, wanted: Bridge, duty: i16) {
        let Some(guarded) = self.axes.get_mut(axis) else { return };
        // A break since the tick began must not be undone by enabling the outputs again.
        let tripped = self.groups.get(guarded.breaker()).is_some_and(|group| group.breaker.has_tripped());
        guarded.apply(wanted, duty, self.settling == 0 && !tripped);
    }

    /// Gives an axis other lines, for another full scale. Sensors, and the zero of the current, stay as they are.
    pub fn put_bridge(&mut self, axis: usize, bridge: HBridge<P::Pwm, P::Pwm, P::Enable>) {
        if let Some(guarded) = self.axes.get_mut(axis) {
            guarded.put_bridge(bridge);
        }
    }
}

impl<B: Breaker> Group<B> {
    /// `open`: every axis behind the breaker was left with an open bridge.
    fn look(&mut self, open: bool) {
        if self.told && open {
            self.breaker.clear();
        }
        self.told = self.breaker.has_tripped();
    }
}
