//! `truing bench`: what it counts is the search's and nothing of the machine's.

use serde_json::Value;
use trials::firmware::truing;

/// A play between motor and load, whose cost is rugged and evolves, and a case with nothing hidden.
const CASES: [&str; 2] = ["single-7801", "nothing-7801"];

/// The bench's JSON, with so many threads.
fn bench(threads: &str) -> Value {
    let mut command = truing();
    command.args(["bench", "--drawn", "3", "--json", "-", "--only"]).args(CASES);
    let output = command.env("RAYON_NUM_THREADS", threads).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// What must not depend on the machine: cases without times and memory.
fn counts(bench: &Value) -> String {
    let listed = |key: &str| bench[key].as_array().unwrap().clone();
    let mut rows = [listed("cases"), vec![bench["total"].clone()]].concat();
    for row in rows.iter_mut().filter_map(Value::as_object_mut) {
        row.retain(|key, _| !["cpu_s", "wall_s"].contains(&key.as_str()));
    }
    serde_json::to_string_pretty(&rows).unwrap()
}

#[test]
fn a_search_does_the_same_work_on_one_thread_and_on_two() {
    let (one, two) = (bench("1"), bench("2"));
    assert_eq!(counts(&one), counts(&two));
    let names: Vec<&str> =
        one["cases"].as_array().unwrap().iter().filter_map(|case| case["case"].as_str()).collect();
    assert_eq!(names, CASES);
    let number = |value: &Value, key: &str| value[key].as_u64().unwrap();
    for key in ["simulations", "inner_steps", "passes"] {
        let sum: u64 = one["cases"].as_array().unwrap().iter().map(|case| number(case, key)).sum();
        assert_eq!(sum, number(&one["total"], key), "{key}");
    }
    // 3,000 rows and more a simulation, and a fit of nothing is a small part of a search for a play.
    let [play, nothing] = [0, 1].map(|place| number(&one["cases"][place], "inner_steps"));
    assert!(
        play > 10 * nothing && nothing > 3000 * number(&one["cases"][1], "simulations"),
        "{play} {nothing}"
    );
}
