//! A log is read without holding its text: lines keep their numbers, and a file reads as its bytes do.

use std::io::Write;
use truing::files::log::{self, Columns, Dynamic, Log};

fn record(log: Log) -> Dynamic {
    match log {
        Log::Dynamic(record) => record,
        Log::Table(_) => panic!("read as a table"),
    }
}

/// The message for a file, which is the same for its bytes.
fn refused(text: &str) -> String {
    let file = written(text.as_bytes());
    let name = file.path().display().to_string();
    let of_file = log::read(file.path(), &Columns::default()).expect_err(text).0;
    let of_bytes = log::parse(&name, text, &Columns::default()).expect_err(text).0;
    assert_eq!(of_file, of_bytes);
    of_file
}

fn written(bytes: &[u8]) -> tempfile::NamedTempFile {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(bytes).unwrap();
    file
}

#[test]
fn an_error_names_the_line_behind_blank_lines_comments_and_quoted_line_feeds() {
    let row = |k: usize| format!("{}.5,1,{k}", k);
    let rows = |range: std::ops::Range<usize>| range.map(row).collect::<Vec<_>>();
    let cases = [
        ("plain", "t_s,u_v,omega_rad_s", "", 32),
        ("blank lines", "t_s,u_v,omega_rad_s", "\n\n \n", 35),
        ("comments", "# one\n% two\nt_s,u_v,omega_rad_s", "// three\n# four\n", 36),
        ("a line feed in a name", "t_s,u_v,omega_rad_s,\"note\nof two lines\"", "", 33),
        ("everything", "\n# one\n\nt_s,u_v,omega_rad_s,\"note\nof two lines\"", "\n# two\n\n", 39),
    ];
    for (what, header, between, line) in cases {
        let more = if header.contains("note") { "," } else { "" };
        let text = |broken: &str| {
            let good = |range| rows(range).iter().map(|row| format!("{row}{more}\n")).collect::<String>();
            format!("{header}\n{}{between}{}{broken}{more}\n{}", good(0..20), good(20..30), good(31..60))
        };
        for end in ["\n", "\r\n", "\r"] {
            // In a file without line feeds a carriage return ends a line, in a quoted name as well.
            let said = refused(&text("30.5,fast,30").replace('\n', end));
            assert!(said.contains(&format!("line {line}: column u_v: `fast`")), "{what}, {end:?}: {said}");
            let said = refused(&text("30.5,1").replace('\n', end));
            assert!(said.contains(&format!("line {line}: ")), "{what}, {end:?}: {said}");
        }
    }
}

#[test]
fn quoted_line_feeds_in_rows_are_counted() {
    let rows: String = (0..60).map(|k| format!("{k},1,{k},\"on\nand on\"\n")).collect();
    let said = refused(&format!("t_s,u_v,omega_rad_s,note\n{}", rows.replace("40,1,40", "40,1,x")));
    assert!(said.contains("line 82: column omega_rad_s: `x`"), "{said}");
}

#[test]
fn a_file_of_many_chunks_reads_as_its_bytes_do() {
    // A name of two-byte letters, so that some letter lies across the end of a chunk.
    let rows: String = (0..30_000)
        .map(|k| format!("{:.3},{},{k},ä{}é\n", 0.001 * f64::from(k), k % 7, "ö".repeat(k as usize % 5)))
        .collect();
    let text = format!("t_s,u_v,omega_rad_s,überall\n{rows}");
    let file = written(text.as_bytes());
    let bits = |record: &Dynamic| -> Vec<u64> {
        let run = &record.runs[0];
        let columns = [&run.t_s, &run.input, run.speed.as_ref().unwrap()];
        columns.into_iter().flatten().map(|value| value.to_bits()).collect()
    };
    let of_file = record(log::read(file.path(), &Columns::default()).unwrap());
    let of_bytes = record(log::parse("log.csv", &text, &Columns::default()).unwrap());
    assert_eq!((of_file.rows(), of_file.runs.len()), (30_000, 1));
    assert_eq!(bits(&of_file), bits(&of_bytes));
    let shifted = record(
        log::read(written(&[b"\xef\xbb\xbf", text.as_bytes()].concat()).path(), &Columns::default()).unwrap(),
    );
    assert_eq!(bits(&shifted), bits(&of_file));
}

#[test]
fn a_column_may_serve_two_quantities_and_words_beside_it_cost_nothing() {
    let rows: String = (0..60).map(|k| format!("{k},{},{k},RUN\n", 0.5 + 0.001 * f64::from(k))).collect();
    let text = format!("t_s,x,omega_rad_s,state\n{rows}");
    let columns: Columns = "duty=x,vbus_v=x*20,i_a=x".parse().unwrap();
    let run = record(log::parse("log.csv", &text, &columns).unwrap()).runs.remove(0);
    for k in 0..60 {
        let x: f64 = format!("{}", 0.5 + 0.001 * k as f64).parse().unwrap();
        assert_eq!(run.input[k], x * (x * 20.0));
        assert_eq!(run.supply_v.as_ref().unwrap()[k], x * 20.0);
        assert_eq!(run.current_a.as_ref().unwrap()[k], x);
    }
}

#[cfg(unix)]
#[test]
fn a_pipe_is_read_too() {
    let (reader, mut writer) = std::io::pipe().unwrap();
    let rows: String = (0..20_000).map(|k| format!("{k},1,{k}\n")).collect();
    let write =
        std::thread::spawn(move || writer.write_all(format!("t_s,u_v,omega_rad_s\n{rows}").as_bytes()));
    let path = format!("/dev/fd/{}", std::os::fd::AsRawFd::as_raw_fd(&reader));
    let log = record(log::read(path.as_ref(), &Columns::default()).unwrap());
    write.join().unwrap().unwrap();
    assert_eq!(log.rows(), 20_000);
}
