//! The paper's claims, and the data files that they are computed from.

use truing::proving::commands::paper;

#[test]
fn the_contradictions_are_found_from_the_tables() {
    let claims = paper::claims();
    let check = |part: &str| claims.checks.iter().find(|c| c.claim.contains(part)).expect(part);
    assert!(check("saturates at 1547 rpm").holds);
    for wrong in [
        "parameters describe",
        "shows a dead zone",
        "in a dead zone",
        "9 V and 6 rad/s",
        "at once",
        "tell a dead zone",
    ] {
        assert!(!check(wrong).holds, "{wrong}: {}", check(wrong).found);
    }
    assert!(check("parameters describe").found.contains("98.79 rpm/V from the parameters, 225.6 rpm/V"));
    assert!(
        check("9 V and 6 rad/s").found.contains("10.0 V · sin(1.000 t − 0.200), rms deviation 0.04 V"),
        "{:?}",
        check("9 V and 6")
    );
    assert!(check("at once").found.contains("2.0 V there, and 9.0 V from 1.0 s"), "{:?}", check("at once"));
    assert!(check("saturates").found.contains("6.79 V"));
    assert!(check("shows a dead zone").found.contains("-0.06 V"), "{:?}", check("shows a dead zone"));
    let table: String = claims.tables[0].rows.concat().join(" ");
    for figure in [
        "10.34 rad/s/V",
        "14.6",
        "worst 7.9",
        "229.3 rpm/V",
        "residual 7.885 rpm",
        "-0.456 and -4.106",
        "rms residual 2.672 rpm",
    ] {
        assert!(table.contains(figure), "{figure} in {table}");
    }
}
