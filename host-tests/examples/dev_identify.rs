//! Throw-away development bench.
use rand::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use servo::axis::Bridge;
use servo::commission::{self, Input, Phase};
use servo::config::Config;

#[derive(Clone, Debug)]
struct P {
    k: f64,
    tm: f64,
    te: f64,
    rho: f64,
    d: [f64; 2],
    hammer: bool,
    stat: f64,
    vs: f64,
    posdep: f64,
    gas: f64,
    drag: f64,
    cog: f64,
    ou: f64,
    sat: [f64; 2],
    sag: f64,
    vbn: f64,
    cpr: f64,
    umax: f64,
    tick: f64,
    rated: f64,
    fs: f64,
    harsh: bool,
    hint: Option<f64>,
    kovr: f64,
}

fn draw(fam: &str, harsh: bool, r: &mut ChaCha8Rng, tick: f64) -> P {
    let u = |r: &mut ChaCha8Rng, a: f64, b: f64| a + (b - a) * r.random::<f64>();
    let (tau, cpr, rpm): (f64, f64, f64) = match fam {
        "g1" => (u(r, 0.02, 0.05), 48.0, u(r, 6000., 12000.)),
        "g2" => (
            u(r, 0.04, 0.09),
            (64f64 * (500f64 / 64.).powf(r.random::<f64>())).round(),
            u(r, 3000., 6000.),
        ),
        "g3" => (
            u(r, 0.08, 0.15),
            [1024., 2048., 4096.][r.random_range(0..3)],
            u(r, 80., 300.),
        ),
        _ => (2.35, 2000.0, 0.0),
    };
    let umax = 12.0;
    let dm = u(r, 0.5, 2.5);
    let asy = u(r, -0.3, 0.3);
    let d = [dm * (1. + asy / 2.), dm * (1. - asy / 2.)];
    let fs = rpm * std::f64::consts::TAU / 60.;
    let rated = fs * u(r, 0.7, 1.3);
    let s0 = u(r, 8.5, 11.2);
    let sa = u(r, -0.1, 0.1);
    let mut p = P {
        k: fs / umax,
        tm: tau,
        te: u(r, 0.0002, 0.0012),
        rho: 0.95,
        d,
        hammer: false,
        stat: u(r, 1.0, if harsh { 1.6 } else { 1.0001 }),
        vs: u(r, 0.003, if harsh { 0.06 } else { 0.03 }) * fs,
        posdep: if harsh { u(r, 0., 0.08) } else { 0. },
        gas: if harsh { u(r, -0.03, 0.03) } else { 0. },
        drag: if harsh { u(r, 0., 0.03) } else { 0. },
        cog: if harsh { u(r, 0., 0.08) } else { 0. },
        ou: if harsh { u(r, 0.01, 0.05) } else { 0. },
        sat: [s0 * (1. + sa / 2.), s0 * (1. - sa / 2.)],
        sag: if harsh { u(r, 0., 0.02) } else { u(r, 0., 0.02) },
        vbn: if harsh { 0.005 } else { 0.003 },
        cpr,
        umax,
        tick,
        rated,
        fs,
        harsh,
        hint: None,
        kovr: 0.,
    };
    if fam == "ref" || fam == "refv" {
        let v = |r: &mut ChaCha8Rng| if fam == "refv" { u(r, -0.2, 0.2).exp() } else { 1.0 };
        p.k = 10.34 * v(r);
        p.tm = 2.35 * v(r);
        p.te = 0.227 * v(r);
        p.rho = 0.62;
        p.hammer = true;
        let dm = if fam == "refv" { u(r, 0.8, 1.6) } else { 1.2 };
        let asy = if fam == "refv" { u(r, -0.3, 0.3) } else { 0. };
        p.d = [dm * (1. + asy / 2.), dm * (1. - asy / 2.)];
        let kn = if fam == "refv" { u(r, 5.2, 6.8) } else { 6.8 };
        p.sat = [kn + p.d[0], kn + p.d[1]];
        p.umax = 12.0;
        p.cpr = if fam == "refv" {
            u(r, 500., 4096.).round()
        } else {
            2000.
        };
        p.fs = p.k * kn;
        p.rated = p.fs * u(r, 0.7, 1.3);
        p.stat = 1.0;
        p.vs = 1.0;
        if p.sat[0] < 0.7 * 12. {
            p.umax = 10.0;
        }
        p.umax = 10.5;
    }
    p
}

struct M<'a> {
    p: &'a P,
    w: f64,
    x: f64,
    th: f64,
    ou: f64,
    r: ChaCha8Rng,
    load: f64,
}
impl M<'_> {
    fn vbus(&self, v: f64) -> f64 {
        let p = self.p;
        p.umax * (1.0 - p.sag * ((v - self.w * p.rho / p.k).abs() / p.umax).min(1.))
    }
    fn run(&mut self, duty: f64, bridge: Bridge, dt: f64) -> f64 {
        let p = self.p;
        let h = if p.hammer { 200e-6 } else { 50e-6f64 }.min(dt);
        let n = (dt / h).round() as usize;
        let h = dt / n as f64;
        let mut vb = p.umax;
        for _ in 0..n {
            vb = self.vbus(self.x);
            let mut v = duty * vb;
            let s = if v >= 0. { 0 } else { 1 };
            v = v.clamp(-p.sat[1], p.sat[0]);
            if p.hammer {
                v = if v > p.d[0] {
                    v - p.d[0]
                } else if v < -p.d[1] {
                    v + p.d[1]
                } else {
                    0.
                }
            }
            v *= if s == 0 { 1. + p.gas / 2. } else { 1. - p.gas / 2. };
            let e = (-h / p.te).exp();
            let xt = if bridge == Bridge::Open {
                0.
            } else {
                v - p.rho * self.w / p.k
            };
            self.x = xt + (self.x - xt) * e;
            let tn: f64 = StandardNormal.sample(&mut self.r);
            let dmean = (p.d[0] + p.d[1]) / 2.;
            self.ou += -self.ou * h / 0.05 + p.ou * dmean * (2. * h / 0.05).sqrt() * tn;
            let drag = p.drag * p.umax * (self.w / p.fs) * (self.w / p.fs).abs();
            let mut tq = self.x - (1. - p.rho) * self.w / p.k - drag - self.load - self.ou
                + p.cog * dmean * (self.th * 7.).sin();
            if !p.hammer {
                let dir = if self.w > 0. || (self.w == 0. && tq > 0.) {
                    0
                } else {
                    1
                };
                let str_ = 1. + (p.stat - 1.) * (-(self.w / p.vs).powi(2)).exp();
                let f = p.d[dir] * str_ * (1. + p.posdep * (self.th * 1.0).sin());
                if self.w == 0. {
                    if tq.abs() <= f {
                        continue;
                    }
                    tq -= f * tq.signum();
                } else {
                    tq -= f * self.w.signum();
                }
            }
            let w2 = self.w + tq * p.k / p.tm * h;
            if !p.hammer && self.w * w2 < 0. {
                self.w = 0.;
            } else {
                self.w = w2;
            }
            self.th += self.w * h;
        }
        vb
    }
    fn count(&self) -> i32 {
        (self.th / std::f64::consts::TAU * self.p.cpr).floor() as i64 as i32
    }
}

fn main() {
    let a: Vec<String> = std::env::args().collect();
    let fam = a.get(1).map_or("g1", |s| s.as_str());
    let harsh = a.get(2).is_some_and(|s| s == "harsh");
    let secs: f64 = a.get(3).map_or(5.0, |s| s.parse().unwrap());
    let n: u64 = a.get(4).map_or(50, |s| s.parse().unwrap());
    let tick: f64 = a.get(5).map_or(1000., |s| s.parse().unwrap());
    let verbose = a.get(6).is_some();
    let res: Vec<_> = (0..n)
        .into_par_iter()
        .map(|i| {
            let mut r = ChaCha8Rng::seed_from_u64(1000 + i);
            let p = draw(fam, harsh, &mut r, tick);
            let cfg = Config {
                supply_nominal_v: p.umax as f32,
                counts_per_rev: p.cpr as u32,
                rated_speed_rad_s: p.rated as f32,
                tick_hz: tick as u32,
                time_constant_hint_s: p.hint.map(|x| x as f32),
                gear_ratio: 1.0,
                travel_limit_rad: None,
                current_limit_a: None,
                energy_limit_j: None,
                speed_limit_rad_s: None,
                pwm_delay_ticks: 1,
                pwm_full_scale: 4200,
                vbus_v_per_lsb: 0.005,
                current_a_per_lsb: 0.01,
            };
            let scale = cfg.build().unwrap();
            let cp = commission::Params::new(&scale, (secs * 1000.) as u32, i as u32);
            let mut m = M {
                p: &p,
                w: 0.,
                x: 0.,
                th: 0.3,
                ou: 0.,
                r: ChaCha8Rng::seed_from_u64(77 + i),
                load: 0.,
            };
            let mut st = commission::State::new(&cp, m.count());
            let mut duty = 0.0;
            let mut vbm = p.umax;
            let mut bridge = Bridge::Driven;
            let mut last = Phase::Idle;
            let mut t = 0u32;
            while !st.ended() {
                let inp = Input {
                    count: m.count(),
                    voltage: (duty * vbm / p.umax * 16384.) as i32,
                    bridge,
                    supply: (vbm / p.umax * 16384.) as i32,
                    current_raw: None,
                };
                let rq = cp.step(&mut st, &inp);
                if st.phase() != last && verbose {
                    last = st.phase();
                    println!("{:.3} {:?} w {:.2} {}", t as f64 / tick, last, m.w / p.fs, 0);
                }
                let vb = m.run(duty, bridge, 1. / tick);
                let nn: f64 = StandardNormal.sample(&mut m.r);
                vbm = vb * (1. + p.vbn * nn);
                duty = ((rq.voltage as f64 / 16384. * p.umax / vbm).clamp(-1., 1.) * 4200.).round() / 4200.;
                bridge = rq.bridge;
                t += 1;
            }
            let o = *st.outcome().unwrap();
            let rep = o.report(&scale);
            (p, rep)
        })
        .collect();
    let mut dd = vec![];
    let mut dk = vec![];
    let mut dt = vec![];
    let mut ds = vec![];
    let mut tr = 0;
    let mut refused = 0;
    let mut ft = 0;
    let mut cov = 0;
    let mut mech = 0;
    let mut nos = 0;
    let mut u95 = vec![];
    let mut wt: f64 = 0.;
    for (p, rep) in &res {
        if rep.refused.is_some() {
            refused += 1;
            if verbose || n <= 20 {
                println!("refused {:?} {:?}", rep.refused, p);
            }
            continue;
        }
        let e = &rep.estimates;
        let mut worst: f64 = 0.;
        let mut all = true;
        for (s, x) in [e.dead_zone_pos_v, e.dead_zone_neg_v].iter().enumerate() {
            let err = 100. * (x.value.unwrap() as f64 / p.d[s] - 1.);
            dd.push(err.abs());
            worst = worst.max(err.abs());
            all &= x.trusted;
            cov += ((x.value.unwrap() as f64 - p.d[s]).abs() <= x.u95.unwrap() as f64) as usize;
            u95.push(100. * x.u95.unwrap() as f64 / p.d[s]);
            if x.trusted && err.abs() > 12. {
                ft += 1;
            }
        }
        if all {
            wt = wt.max(worst);
        }
        tr += all as usize;
        dk.push(100. * (e.gain_rad_s_per_v.value.unwrap() as f64 / p.k - 1.));
        let teff = p.tm + (1. - p.rho) * p.te;
        dt.push(100. * (e.time_constant_s.value.unwrap() as f64 / teff - 1.));
        for (s, x) in [e.saturation_pos_v, e.saturation_neg_v].iter().enumerate() {
            match x.value {
                Some(v) => ds.push(100. * (v as f64 / p.sat[s] - 1.)),
                None => nos += 1,
            }
        }
        let want = if p.hammer {
            servo::identify::estimate::Mechanism::InputDeadZone
        } else {
            servo::identify::estimate::Mechanism::Friction
        };
        mech += (e.mechanism == want) as usize;
        if verbose || n <= 10 {
            println!(
                "d {:?} est {:?} {:?} K {:.3} tau {:.4} ({:.4}) mech {:?} sat {:?} {:?} of {:?}",
                p.d,
                e.dead_zone_pos_v,
                e.dead_zone_neg_v,
                dk.last().unwrap(),
                e.time_constant_s.value.unwrap(),
                p.tm,
                e.mechanism,
                e.saturation_pos_v.value,
                e.saturation_neg_v.value,
                p.sat
            );
        }
    }
    let q = |v: &[f64]| {
        let mut a: Vec<f64> = v.iter().map(|x| x.abs()).collect();
        a.sort_by(f64::total_cmp);
        if a.is_empty() {
            return "-".to_string();
        }
        let g = |f: f64| a[((a.len() - 1) as f64 * f) as usize];
        format!("{:.3}/{:.3}/{:.2}", g(0.5), g(0.95), g(1.0))
    };
    println!(
        "{fam} {} {secs}s {tick}Hz n={n}: d {} K {} tau {} sat {} none {nos} | refused {refused} trusted {tr} worst {wt:.1} falseTrust {ft} cov {cov}/{} u95 {} mech {mech}",
        if harsh { "harsh" } else { "nominal" },
        q(&dd),
        q(&dk),
        q(&dt),
        q(&ds),
        dd.len(),
        q(&u95)
    );
    let _ = (&res[0].0.hint, res[0].0.kovr, res[0].0.harsh);
}
