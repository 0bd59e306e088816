//! The helper beside an MJCF: a Python program with the lines that this model needs, and no others.

use crate::plan::{Actuator, Plan, SOFT, touches};
use truing_core::system::plant::laws::Law;
use truing_core::system::plant::physics::{Drive, Physics};

/// The program. `head`: lines of its comment.
pub fn written(p: &Physics, head: &[String]) -> String {
    let plan = Plan::of(p);
    let mut lines: Vec<String> = head.iter().map(|line| format!("# {line}")).collect();
    let mut add = |text: &str| lines.extend(text.lines().map(str::to_owned));
    add("import math\nfrom collections import deque\nimport mujoco\n\n");
    add("class Servo:");
    add(
        "    \"\"\"Callbacks of one servo: `install` sets them, and its `read` is what the sensor of the speed shows.\"\"\"",
    );
    add("    def __init__(self, model):");
    add("        self.motor, self.shaft = model.actuator(\"motor\").id, model.joint(\"shaft\").dofadr[0]");
    add("        self.time, self.torque, self.lagged, self.angle = -1.0, 0.0, 0.0, 0.0");
    add(&states(p, plan.actuator == Actuator::Helper));
    add("    def control(self, model, data):");
    add("        if data.time == self.time: return  # one step, one advance");
    add("        h, self.time = model.opt.timestep, data.time");
    add("        w = data.qvel[self.shaft] + h / 2 * data.qacc[self.shaft]  # in the middle of the step");
    if plan.actuator == Actuator::Helper {
        add(&chain(p));
        add(&winding(p));
    }
    if plan.friction {
        add(&friction(p));
    }
    if plan.torques {
        add(&torques(p));
    }
    if plan.reading {
        add("        self.read(data)");
        add(&reading(p));
    }
    add("\ndef install(model):");
    add("    servo = Servo(model)");
    add("    mujoco.set_mjcb_control(servo.control)");
    if plan.actuator == Actuator::Helper {
        add("    mujoco.set_mjcb_act_bias(lambda model, data, i: servo.torque if i == servo.motor else 0.0)");
    }
    add("    return servo");
    lines.join("\n") + "\n"
}

/// What the helper remembers beside the engine; of the drive where that is its own.
fn states(p: &Physics, drives: bool) -> String {
    let mut text = String::new();
    if drives && p.inductance > 0.0 {
        text += "        self.current = 0.0\n";
    }
    if drives && p.heat_rise_per_w > 0.0 {
        text += "        self.heat = 0.0\n";
    }
    if drives && p.source_ohm > 0.0 && p.bus_farad > 0.0 {
        text += &format!("        self.supply = {:?}\n", p.supply_v);
    }
    if drives && p.delay_s > 0.0 {
        text += &format!("        n = int({:?} // model.opt.timestep)\n", p.delay_s);
        text += "        self.late = deque([0.0] * (n + 2), n + 2)\n";
    }
    if drives && p.lag_s > 0.0 {
        text += "        self.drive = 0.0\n";
    }
    if p.gap_rad > 0.0 && p.load_share <= 0.0 {
        text += "        self.play = 0.0\n";
    }
    text += "        self.read_at = 0.0\n";
    text
}

/// From the command to what the winding gets: `v`.
fn chain(p: &Physics) -> String {
    let mut text = String::from("        v = data.ctrl[self.motor]\n");
    let mut add = |line: String| text += &format!("        {line}\n");
    if p.delay_s > 0.0 {
        add("self.late.append(v)".into());
        add(format!("part = {:?} / h % 1.0", p.delay_s));
        add("v = self.late[1] * (1 - part) + self.late[0] * part".into());
    }
    if p.lag_s > 0.0 {
        add(format!("rest, decay = self.drive - v, math.exp(-h / {:?})", p.lag_s));
        add(format!("self.drive, v = v + rest * decay, v + rest * (1 - decay) * {:?} / h", p.lag_s));
    }
    if p.drive_gain != 1.0 || p.drive_offset != 0.0 {
        add(format!("v = {:?} * v + {:?}", p.drive_gain, p.drive_offset));
    }
    if p.dead_softness > 0.0 {
        add(format!("s, soft = {:?}, lambda z: z if z > 30 else math.log1p(math.exp(z))", p.dead_softness));
        add(format!("v = s * (soft((v - {:?}) / s) - soft((-v - {:?}) / s))", p.dead_pos, p.dead_neg));
    } else if p.dead_pos > 0.0 || p.dead_neg > 0.0 {
        add(format!("v = max(v - {:?}, 0.0) - max(-v - {:?}, 0.0)", p.dead_pos, p.dead_neg));
    }
    if p.limit.is_finite() {
        add(format!("limit = {:?} if v >= 0 else {:?}", p.limit, p.limit * p.limit_skew));
        add(if p.limit_softness > SOFT {
            let s = p.limit_softness;
            format!("v = v / (1 + abs(v / limit) ** (1 / {s:?})) ** {s:?}")
        } else {
            "v = max(-limit, min(limit, v))".into()
        });
    }
    text
}

/// From there to the torque.
fn winding(p: &Physics) -> String {
    let mut text = String::new();
    let mut add = |line: String| text += &format!("        {line}\n");
    let limit = p.current_limit;
    let knee = |current: &str| {
        if p.kt_knee_a.is_finite() {
            format!(" / (1 + ({current} / {:?}) ** 2)", p.kt_knee_a)
        } else {
            String::new()
        }
    };
    if p.drive == Drive::Torque {
        if limit.is_finite() {
            add(format!("v = max(-{limit:?}, min({limit:?}, v))"));
        }
        add(format!("self.torque = {:?} * v{}", p.force_gain, knee("v")));
        return text;
    }
    add(format!("r = {:?}", p.resistance));
    if p.heat_rise_per_w > 0.0 {
        add(format!("r *= 1 + {:?} * self.heat", p.heat_rise_per_w));
    }
    let slow = p.source_ohm > 0.0 && p.bus_farad > 0.0;
    if p.source_ohm > 0.0 {
        add(format!("duty = v / {:?}", p.supply_v));
        add(if slow {
            "v = duty * self.supply".into()
        } else {
            format!("r += {:?} * duty * duty", p.source_ohm)
        });
    }
    add(format!("net = v - {:?} * w", p.ke));
    if p.inductance > 0.0 {
        add(format!("decay = math.exp(-r * h / {:?})", p.inductance));
        if p.drop_v > 0.0 {
            add("following = net / r + (self.current - net / r) * decay".into());
            add(format!("blocked = abs(following) <= {:?} / r * (1 - decay)", p.drop_v));
            add(format!("net = 0.0 if blocked else net - math.copysign({:?}, following)", p.drop_v));
        }
        add(format!("share = (1 - decay) * {:?} / (r * h)", p.inductance));
        add("i = net / r + (self.current - net / r) * share".into());
        add("self.current = net / r + (self.current - net / r) * decay".into());
        if limit.is_finite() {
            add(format!("self.current = max(-{limit:?}, min({limit:?}, self.current))"));
        }
    } else {
        if p.drop_v > 0.0 {
            add(format!("net = math.copysign(max(abs(net) - {:?}, 0.0), net)", p.drop_v));
        }
        add("i = net / r".into());
    }
    if limit.is_finite() {
        add(format!("i = max(-{limit:?}, min({limit:?}, i))"));
    }
    if p.heat_rise_per_w > 0.0 {
        add(format!("self.heat += (i * i * r - self.heat) * (1 - math.exp(-h / {:?}))", p.heat_time_s));
    }
    if slow {
        add(format!("settled = {:?} - {:?} * duty * i", p.supply_v, p.source_ohm));
        add(format!(
            "self.supply = settled + (self.supply - settled) * math.exp(-h / {:?})",
            p.source_ohm * p.bus_farad
        ));
    }
    add(format!("self.torque = {:?} * i{}", p.kt, knee("i")));
    text
}

/// The level of dry friction in this step.
fn friction(p: &Physics) -> String {
    let mut level = format!("{:?}", (p.friction_pos + p.friction_neg) / 2.0);
    if p.breakaway_extra > 0.0 {
        level += &format!(" + {:?} * math.exp(-(w / {:?}) ** 2)", p.breakaway_extra, p.stribeck_speed);
    }
    if p.friction_per_motor > 0.0 {
        level += &format!(" + {:?} * abs(self.torque)", p.friction_per_motor);
    }
    let mut text = String::new();
    if p.friction_per_load > 0.0 {
        text += &format!("        q = data.qpos[0] + h / 2 * w\n        load = {}\n", loads(p));
        level += &format!(" + {:?} * abs(load)", p.friction_per_load);
    }
    text + &format!("        model.dof_frictionloss[self.shaft] = {level}  # acts from the next step on\n")
}

/// The torque on the load, as a term of Python.
fn loads(p: &Physics) -> String {
    let terms = p.torques.iter().filter_map(|law| {
        let [a, b, c] = law.parameters;
        let n = p.gear_ratio;
        Some(match law.law {
            Law::Constant => format!("{a:?}"),
            Law::Gravity => format!("-{:?} * math.sin(q / {n:?} + {b:?})", a / n),
            Law::Periodic => periodic(a, b, c),
            Law::Spring => format!("-(q - {b:?}) * ({a:?} + {c:?} * (q - {b:?}) ** 2)"),
            _ => return None,
        })
    });
    let terms: Vec<String> = terms.collect();
    if terms.is_empty() { "0.0".into() } else { terms.join(" + ") }
}

fn periodic(amplitude: f64, hertz: f64, phase: f64) -> String {
    format!("{amplitude:?} * math.sin(2 * math.pi * {hertz:?} * (data.time + h / 2) + {phase:?})")
}

/// Torques that MJCF has no words for.
fn torques(p: &Physics) -> String {
    let mut text = String::new();
    let mut add = |line: String| text += &format!("        {line}\n");
    if p.viscous_pos != p.viscous_neg {
        add(format!(
            "data.qfrc_passive[self.shaft] -= w * ({:?} if w > 0 else {:?})",
            p.viscous_pos, p.viscous_neg
        ));
    }
    for law in p.torques.iter().filter(|law| law.law == Law::Periodic) {
        let [a, b, c] = law.parameters;
        let load = if p.load_share > 0.0 {
            "for k in (self.shaft, self.shaft + 1): data.qfrc_passive[k]"
        } else {
            "data.qfrc_passive[self.shaft]"
        };
        add(format!("{load} += {}", periodic(a, b, c)));
    }
    if touches(p) {
        let reduced = p.inertia * p.load_share * (1.0 - p.load_share);
        let (k, c) = (reduced * p.contact_rad_s.powi(2), 2.0 * p.contact_damping * reduced * p.contact_rad_s);
        add("rate = data.qvel[self.shaft + 1]".into());
        add("twist = data.qpos[self.shaft + 1] + h / 2 * rate".into());
        add(format!("depth, side = abs(twist) - {:?}, math.copysign(1.0, twist)", p.gap_rad / 2.0));
        add(format!("push = side * ({k:?} * depth + {c:?} * side * rate) if depth > 0 else 0.0"));
        add("data.qfrc_passive[self.shaft + 1] -= push if push * side > 0 else 0.0".into());
    }
    text
}

/// What the sensor of the speed shows: asked after a step, and in every step.
fn reading(p: &Physics) -> String {
    let mut text = String::from("\n    def read(self, data):\n");
    let mut add = |line: String| text += &format!("        {line}\n");
    let sensed = if p.encoder_at_load && p.load_share > 0.0 {
        ("data.qpos[0] + data.qpos[1]", "data.qvel[0] + data.qvel[1]")
    } else {
        ("data.qpos[0]", "data.qvel[0]")
    };
    add("h = data.time - self.read_at".into());
    add(format!("at, y = {}, {}", sensed.0, sensed.1));
    if p.encoder_at_load && p.gap_rad > 0.0 && p.load_share <= 0.0 {
        let half = p.gap_rad / 2.0;
        add("was = self.play".into());
        add(format!("self.play = at = min(max(self.play, at - {half:?}), at + {half:?})"));
        add("if h > 0: self.rate = (at - was) / h".into());
        add("y = getattr(self, 'rate', 0.0)".into());
    }
    let scale = p.sensor_scale;
    if p.sensor_lag_s > 0.0 {
        add(format!("mean = {scale:?} * (at - self.angle) / h if h > 0 else 0.0"));
        if p.sensor_rectified {
            add("mean = abs(mean)".into());
        }
        add(format!(
            "if h > 0: self.lagged = mean + (self.lagged - mean) * math.exp(-h / {:?})",
            p.sensor_lag_s
        ));
        add("y = self.lagged".into());
    } else {
        add(format!(
            "y = {}",
            if p.sensor_rectified { format!("abs({scale:?} * y)") } else { format!("{scale:?} * y") }
        ));
    }
    add("self.angle, self.read_at = at, data.time".into());
    if p.sensor_limit.is_finite() {
        add(format!("y = max(-{0:?}, min({0:?}, y))", p.sensor_limit));
    }
    add(format!("return y + {:?}", p.sensor_offset));
    text
}
