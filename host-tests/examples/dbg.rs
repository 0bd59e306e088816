use host_tests::bench::Bench;
use host_tests::families::{Family, Options, Plant, Seeds, Severity};
use servo::axis::Command;
use servo::optional::Optional;
fn main() {
    let options = Options { tick_hz: 10_000, ..Options::default() };
    let args: Vec<String> = std::env::args().collect();
    let n: u32 = args[1].parse().unwrap();
    let share: f64 = args[2].parse().unwrap();
    let fam = match args[3].as_str() {
        "G1" => Family::G1,
        "G2" => Family::G2,
        _ => Family::G3,
    };
    let every: u32 = args[4].parse().unwrap();
    let mut plant = Plant::draw(fam, Severity::Nominal, Seeds::Design(n), &options);
    let limit = share * plant.motor.drive.supply_v / plant.motor.resistance_ohm;
    plant.sensing.current = true;
    plant.config.current_limit_a = Optional::new(limit as f32);
    plant.config.current_a_per_lsb = (0.04 * limit) as f32;
    println!("{:?}\n{:?}", plant.motor, plant.config);
    let mut b = Bench::new(&plant);
    b.ask(Command::Arm).unwrap();
    b.ask(Command::Commission { budget_ms: 5000, seed: n }).unwrap();
    for k in 0..100_000u32 {
        let o = b.tick();
        let r = b.board.reading();
        if k % every == 0 {
            println!(
                "{:.4} ph{} duty{} i{:.3} raw{} cnt{} th{:.4} w{:.2} lim{:?}",
                f64::from(k) / 1e4,
                o.record.phase,
                f64::from(o.record.duty) / 4200.0,
                r.current / limit,
                o.record.current_raw,
                o.record.count,
                r.theta,
                r.omega,
                o.record.limit
            );
        }
        if k > 100 && o.record.activity != servo::record::Activity::Commissioning {
            println!(
                "{k} {:?} {:?}",
                o.record.fault,
                b.axis.report(&b.state).commissioning.map(|c| c.refused)
            );
            break;
        }
    }
}
