//! Logs as people have them: every way to write the same table reads to the same bits, and what cannot be read says what to do.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truing::system::log::{self, Columns, Dynamic, Log, Reading};

/// Time in s, voltage, speed in rpm, as they are written.
fn data(seed: u64) -> Vec<[String; 3]> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut omega = 0.0;
    let row = |k: usize| {
        let u = if k % 20 < 10 { 6.25 } else { -3.5 };
        omega += 0.2 * (100.0 * u - omega) + random.random_range(-2.0..2.0);
        [format!("{:.3}", 0.01 * k as f64), format!("{u:.2}"), format!("{omega:.4}")]
    };
    (0..60).map(row).collect()
}

fn read(bytes: &[u8], columns: &str) -> Result<Reading, String> {
    let columns: Columns = columns.parse().map_err(|error: truing::text::input_error::InputError| error.0)?;
    log::parse_bytes("log.csv", bytes, &columns).map_err(|error| error.0)
}

fn record(bytes: &[u8], columns: &str) -> Dynamic {
    match read(bytes, columns).unwrap_or_else(|error| panic!("{error}")).log {
        Log::Dynamic(record) => record,
        Log::Table(_) => panic!("read as a table"),
    }
}

/// Bits of time, input and speed of the first run.
fn bits(record: &Dynamic) -> [Vec<u64>; 3] {
    let run = &record.runs[0];
    let of = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect();
    [of(&run.t_s), of(&run.input), of(run.speed.as_ref().unwrap())]
}

fn table(header: &str, rows: &[[String; 3]], separator: &str) -> String {
    let rows: Vec<String> = rows.iter().map(|row| row.join(separator)).collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

/// The same in the format's own words.
fn plain(rows: &[[String; 3]]) -> String {
    table("t_s,u_v,omega_rpm", rows, ",")
}

fn utf16(text: &str, little: bool, mark: bool) -> Vec<u8> {
    let units = mark.then_some(0xfeff).into_iter().chain(text.encode_utf16());
    units.flat_map(|unit: u16| if little { unit.to_le_bytes() } else { unit.to_be_bytes() }).collect()
}

fn latin_1(text: &str) -> Vec<u8> {
    text.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap()).collect()
}

/// One way to write a table.
#[derive(Clone, Copy, Debug)]
struct Way {
    separator: &'static str,
    comma: bool,
    quoted: bool,
    units_below: bool,
    comments: bool,
    end: &'static str,
    encoding: &'static str,
}

fn written(way: Way, rows: &[[String; 3]]) -> Vec<u8> {
    let cell = |cell: &str| {
        let cell = if way.comma { cell.replace('.', ",") } else { cell.to_owned() };
        if way.quoted { format!("\"{cell}\"") } else { cell }
    };
    let line = |cells: &[&str]| cells.iter().map(|text| cell(text)).collect::<Vec<_>>().join(way.separator);
    let mut lines = Vec::new();
    if way.comments {
        lines.extend(["# logged on a bench".to_owned(), "% über Nacht".into(), String::new()]);
    }
    match way.units_below {
        true => lines.extend([line(&["Zeit", "Spannung", "Drehzahl"]), line(&["s", "V", "1/min"])]),
        false => lines.push(line(&["Zeit[s]", "Spannung[V]", "Drehzahl[U/min]"])),
    }
    for (k, row) in rows.iter().enumerate() {
        lines.push(line(&row.each_ref().map(String::as_str)));
        if way.comments && k == 30 {
            lines.push("// the half".into());
        }
    }
    let text = lines.join(way.end) + way.end;
    match way.encoding {
        "utf-8 with a mark" => [b"\xef\xbb\xbf", text.as_bytes()].concat(),
        "utf-16 le" => utf16(&text, true, true),
        "utf-16 be" => utf16(&text, false, true),
        "latin-1" => latin_1(&text),
        _ => text.into_bytes(),
    }
}

#[test]
fn the_same_data_read_to_the_same_bits_in_every_dialect() {
    let encodings = ["utf-8", "utf-8 with a mark", "utf-16 le", "utf-16 be", "latin-1"];
    let mut tried = 0;
    for seed in 0..3 {
        let rows = data(seed);
        let wanted = bits(&record(plain(&rows).as_bytes(), ""));
        for separator in [",", ";", "\t", " ", " ; ", "   "] {
            for choice in 0..16 {
                let [comma, quoted, units_below, comments] = [1, 2, 4, 8].map(|bit| choice & bit != 0);
                if separator == "," && comma && !quoted {
                    continue;
                }
                for end in ["\n", "\r\n", "\r"] {
                    let encoding = encodings[tried % encodings.len()];
                    let way = Way { separator, comma, quoted, units_below, comments, end, encoding };
                    let reading =
                        read(&written(way, &rows), "").unwrap_or_else(|error| panic!("{way:?}: {error}"));
                    let Log::Dynamic(record) = reading.log else { panic!("{way:?}: a table") };
                    assert_eq!(bits(&record), wanted, "{way:?}");
                    tried += 1;
                }
            }
        }
    }
    assert!(tried > 800, "{tried}");
}

/// What a file is expected to do.
enum Expected {
    /// Reads to the bits of the plain file, and says these words in its notes.
    Reads(&'static [&'static str]),
    /// Reads so many rows, and says these words.
    Rows(usize, &'static [&'static str]),
    /// Is refused with these words.
    Says(&'static [&'static str]),
}
use Expected::{Reads, Rows, Says};

#[test]
fn foreign_headers_are_read_or_answered_with_the_line_that_mends_them() {
    let rows = data(7);
    let wanted = bits(&record(plain(&rows).as_bytes(), ""));
    let time = "t_ms=";
    // Header, --columns, what is expected. Columns are time in s, voltage, speed in rpm.
    let cases: Vec<(&str, &str, Expected)> = vec![
        ("t_s,u_v,omega_rpm", "", Reads(&[])),
        ("T_S,U_V,Omega_RPM", "", Reads(&[])),
        ("time_s,voltage_v,speed_rpm", "", Reads(&[])),
        ("Time [s],Voltage [V],Speed [rpm]", "", Reads(&["`Time [s]` as t_s", "`Speed [rpm]` as omega_rpm"])),
        ("Time (s),Voltage (V),Speed (rpm)", "", Reads(&["`Voltage (V)` as u_v"])),
        ("Zeit [s],Spannung [V],Drehzahl [1/min]", "", Reads(&["`Drehzahl [1/min]` as omega_rpm"])),
        ("Zeit in s,Motorspannung in V,Drehzahl in min^-1", "", Reads(&["`Zeit in s`"])),
        ("Temps [s],Tension [V],Vitesse [tr/min]", "", Reads(&["`Vitesse [tr/min]`"])),
        ("timeSec,motorVoltageV,motorSpeedRpm", "", Reads(&["`timeSec` as t_s"])),
        ("seconds,volts,rpm", "", Reads(&["`rpm` as omega_rpm"])),
        ("time / s,voltage / V,n / rpm", "", Reads(&["`n / rpm`"])),
        ("Time [sec],Terminal Voltage [Volts],Shaft Speed [rev/min]", "", Reads(&[])),
        ("Time_[s],u_[V],w_[rpm]", "", Reads(&[])),
        ("t [s],cmd voltage [V],measured speed [rpm]", "", Reads(&[])),
        ("\"Time [s]\",\"Voltage [V]\",\"rpm (1/min, filtered)\"", "", Reads(&["filtered"])),
        ("time,u_v,omega_rpm", "", Says(&["`time` (0 … 0.59)", "as if in s", "--columns \"t_s=time\""])),
        ("time,u_v,omega_rpm", "t_s=time", Reads(&[])),
        (
            "t_s,PWM,omega_rpm",
            "",
            Says(&["`PWM` (-3.5 … 6.25)", "--columns \"duty=PWM/100,vbus_v=12\"", "nominal_v"]),
        ),
        ("t_s,voltage,omega_rpm", "", Says(&["guessed in V", "--columns \"u_v=voltage\""])),
        (
            "t_s,u_v,speed",
            "",
            Says(&["without a unit", "--columns \"omega_rpm=speed\"", "omega_rad_s=speed"]),
        ),
        ("t_s,u_v,left_rpm", "", Says(&["`left_rpm`", "--columns \"omega_rpm=left_rpm\""])),
        ("t_s,u_v,left_rpm", "omega_rpm=left_rpm", Reads(&[])),
        ("t_s,u_v,rpm (1/min, raw)", "omega_rpm=\"x\"", Says(&["3", "header"])),
        ("t_s,u_v,\"rpm (1/min, odd)\"", "omega_rpm=\"rpm (1/min, odd)\"", Reads(&[])),
        ("t_s,u_v,\"rpm (1/min, odd)\"", "omega_rpm='rpm (1/min, odd)'*1", Reads(&[])),
        ("t_s,u_v,pos_counts", "", Says(&["counts an encoder", "--columns \"theta_rev=pos_counts/4096\""])),
        ("t_s,u_v,qref_m", "", Says(&["speed or the position", "qref_m"])),
        ("t_s,u_v,target_rpm", "", Says(&["speed or the position", "target_rpm"])),
        ("t_s,u_v,omega_furlong_s", "", Says(&["omega_furlong_s", "unknown unit"])),
        ("t_s,u_kv,omega_rpm", "", Says(&["u_kv", "unknown unit"])),
        ("t_s,strom [A],omega_rpm", "", Says(&["if a loop holds it", "--columns \"current_a=strom [A]\""])),
        ("t_s,u_v,u_v", "", Says(&["line 1", "two columns are named `u_v`", "rename one"])),
        ("t_s,u_v,voltage_v", "", Says(&["same quantity", "--columns \"u_v=voltage_v\""])),
        ("zeit,u,n", "t_s=zeit,u_v=u,omega_rpm=n", Reads(&[])),
        ("zeit,u,n", "t_ms=zeit*1000,u_v=u,omega_rpm=n", Rows(60, &[])),
        ("zeit,u,n", "t_s=(zeit),u_v=u+0,omega_rpm=n/1", Reads(&[])),
        ("zeit,u,n", "t_s=zeit,u_v=u/255*12,omega_rpm=n", Rows(60, &[])),
        ("zeit,u,n", "t_s=zeit,duty=u/10,vbus_v=12,omega_rpm=n", Rows(60, &[])),
        ("zeit,u,n", "t_s=row*0.01,u_v=u,omega_rpm=n", Rows(60, &[])),
        ("zeit,u,n", "t_s=zeit,u_v=u/,omega_rpm=n", Says(&["--columns, `u_v=u/`", "cannot be computed"])),
        ("zeit,u,n", "t_s=zeit,u_v=u/m,omega_rpm=n", Says(&["`m`", "lacks", "zeit, u, n"])),
        ("zeit,u,n", "t_s=zeit,u_v=1/zeit,omega_rpm=n", Says(&["line 2", "gives inf"])),
        ("zeit,u,n", "t_s=zeit,u_v=u*0,omega_rpm=n", Says(&["factor"])),
        ("zeit,u,n", "t_s=zeit,u_v=,omega_rpm=n", Says(&["nothing stands behind"])),
        ("zeit,u,n", "u_v=u,u_mv=zeit", Says(&["holds the same quantity", "choose one"])),
        ("zeit,u,n", "t_s=zeit,volts=u", Says(&["`volts` is no known column"])),
        ("zeit,u,n", "t_s=zeit,duty=u,vbus_v=12,omega_rpm=n", Says(&["outside", "duty=u/100"])),
        ("t_s,duty,omega_rpm", "", Says(&["vbus_v", "--columns \"vbus_v=12\"", "nominal_v"])),
        ("t_s,u [V],omega_rpm", "", Reads(&["`u [V]` as u_v"])),
        (time, "", Says(&["cells"])),
    ];
    for (header, columns, expected) in cases {
        let text = table(header, &rows, ",");
        check(&format!("{header} {columns}"), text.as_bytes(), columns, &expected, &wanted);
    }
}

fn check(what: &str, bytes: &[u8], columns: &str, expected: &Expected, wanted: &[Vec<u64>; 3]) {
    let reading = read(bytes, columns);
    let words = match expected {
        Reads(words) | Rows(_, words) | Says(words) => words,
    };
    let said = match (&reading, expected) {
        (Err(error), Says(_)) => error.clone(),
        (Ok(reading), Reads(_) | Rows(..)) => {
            let Log::Dynamic(record) = &reading.log else { panic!("{what}: a table") };
            match expected {
                Rows(rows, _) => assert_eq!(record.rows(), *rows, "{what}"),
                _ => assert_eq!(&bits(record), wanted, "{what}"),
            }
            reading.notes.join(" ")
        }
        (Ok(reading), _) => panic!("{what}: is read ({})", reading.notes.join(" ")),
        (Err(error), _) => panic!("{what}: {error}"),
    };
    assert!(!said.contains('\n'), "{what}: {said}");
    words.iter().for_each(|word| assert!(said.contains(word), "{what}: `{word}` is not in: {said}"));
}

#[test]
fn damaged_and_odd_files_are_read_or_named_by_line_and_remedy() {
    let rows = data(9);
    let good = plain(&rows);
    let wanted = bits(&record(good.as_bytes(), ""));
    let line = |number: usize, new: &str| {
        let mut lines: Vec<&str> = good.lines().collect();
        lines[number - 1] = new;
        lines.join("\n") + "\n"
    };
    let inserted = |number: usize, new: &str| {
        let mut lines: Vec<&str> = good.lines().collect();
        lines.insert(number - 1, new);
        lines.join("\n") + "\n"
    };
    let trailing = good.replace('\n', ",\n");
    let trailing_rows = good
        .replacen(",\n", "\n", 1)
        .lines()
        .enumerate()
        .fold(String::new(), |text, (k, line)| text + line + if k == 0 { "\n" } else { ",\n" });
    let two_parts = format!("{good}{good}");
    let in_comment = format!("# {}", good.replace(',', " "));
    let comma = line(30, "0.280,6x25,5.5").replace(',', ";").replace("6x25", "6,25");
    let point = line(30, "0.280,6x25,5.5").replace(',', ";").replace('.', ",").replace("6x25", "6.25");
    let two_nan = line(20, "0.180,6,NaN").replacen(&rows[40].join(","), "0.400,6,nan", 1);
    let semicolons = good.replace(',', ";");
    let cases: Vec<(&str, Vec<u8>, Expected)> = vec![
        ("nothing", vec![], Says(&["empty"])),
        ("blank lines alone", b"\n\n \n".to_vec(), Says(&["empty"])),
        ("comments alone", b"# a\n# b\n".to_vec(), Says(&["log.csv"])),
        ("a header alone", b"t_s,u_v,omega_rpm\n".to_vec(), Says(&["no rows"])),
        (
            "no header",
            good.lines().skip(1).collect::<Vec<_>>().join("\n").into_bytes(),
            Says(&["line 1", "header line", "(c1, c2, c3)", "--columns \"t_ms=c1,u_v=c2"]),
        ),
        (
            "names are missing",
            good.replacen("t_s,u_v,omega_rpm", ",,", 1).into_bytes(),
            Says(&["header line"]),
        ),
        ("bytes of a picture", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec(), Says(&["not a text file"])),
        ("bytes of an archive", b"PK\x03\x04\x14\xff\xfe\x80".to_vec(), Says(&["not a text file"])),
        ("utf-16 without a mark", utf16(&good, true, false), Reads(&["UTF-16LE"])),
        ("utf-16 with a mark", utf16(&good, false, true), Reads(&["UTF-16BE"])),
        ("old line ends", good.replace('\n', "\r").into_bytes(), Reads(&[])),
        ("no end of the last line", good.trim_end().as_bytes().to_vec(), Reads(&[])),
        ("blank lines between", good.replace('\n', "\n\n").into_bytes(), Reads(&[])),
        ("empty cells at the end", (good.clone() + ",,\n,,\n").into_bytes(), Reads(&[])),
        ("a comma at each end", trailing.into_bytes(), Reads(&[])),
        ("a comma at each end of a row", trailing_rows.into_bytes(), Reads(&[])),
        ("a title before", format!("Bench 3\nrun of May 4\n{good}").into_bytes(), Reads(&["after 2 lines"])),
        ("the header in a comment", in_comment.into_bytes(), Reads(&["header in a comment", "blanks"])),
        ("comments of three kinds", format!("# a\n% b\n// c, d\n{good}").into_bytes(), Reads(&[])),
        (
            "last row cut between cells",
            good.as_bytes()[..good.len() - 10].to_vec(),
            Rows(59, &["line 61", "cut"]),
        ),
        (
            "last row cut inside a number",
            good.as_bytes()[..good.len() - 3].to_vec(),
            Rows(59, &["line 61", "cut"]),
        ),
        ("last row cut behind a comma", line(61, "0.590,").into_bytes(), Rows(59, &["cut"])),
        (
            "a short row",
            line(20, "0.180,6").into_bytes(),
            Says(&["line 20", "2 cells", "3", "remove the row"]),
        ),
        ("a long row", line(20, "0.180,6,1,2").into_bytes(), Says(&["line 20", "4 cells", "remove the row"])),
        (
            "several short rows",
            line(20, "0.180,6").replace("\n0.400,", "\n0.400 ").into_bytes(),
            Says(&["line 20", "line 42"]),
        ),
        (
            "a word",
            line(20, "0.180,6,fast").into_bytes(),
            Says(&["line 20", "omega_rpm", "`fast`", "not a number"]),
        ),
        ("infinity", line(20, "0.180,6,inf").into_bytes(), Says(&["line 20", "omega_rpm", "finite"])),
        ("one NaN", line(20, "0.180,6,NaN").into_bytes(), Rows(60, &["1 of 60 rows", "interpolated"])),
        ("one empty cell", line(20, "0.180,6,").into_bytes(), Rows(60, &["1 of 60 rows"])),
        ("one #N/A", line(20, "0.180,6,#N/A").into_bytes(), Rows(60, &["1 of 60 rows"])),
        (
            "one row without input",
            line(31, "0.290,,1").into_bytes(),
            Rows(59, &["1 are left out", "cut there"]),
        ),
        (
            "two NaN are too many",
            two_nan.into_bytes(),
            Says(&["line 20", "omega_rpm", "2 of 60 rows", "2 %"]),
        ),
        (
            "time stands still",
            inserted(21, "0.180,6,1").into_bytes(),
            Rows(60, &["same time the last one is read", "line 20"]),
        ),
        (
            "a time that is too early",
            inserted(21, "0.05,6,1").into_bytes(),
            Reads(&["do not fit between their neighbours", "line 21"]),
        ),
        (
            "a time that is too late",
            inserted(21, "7000,6,1").into_bytes(),
            Reads(&["do not fit between their neighbours", "line 21"]),
        ),
        (
            "words between the rows",
            inserted(31, "next level").into_bytes(),
            Reads(&["lines that hold no number (1)"]),
        ),
        (
            "a page of the web",
            b"<!DOCTYPE html>\n<html><body>1,2,3</body></html>\n".to_vec(),
            Says(&["page for a browser", "download the file itself"]),
        ),
        (
            "prose",
            b"Dear reader,\nthis is no log,\nonly words.\n".to_vec(),
            Says(&["no rows of numbers", "Dear reader"]),
        ),
        ("the logger started anew", two_parts.into_bytes(), Rows(120, &[])),
        ("a clock", line(20, "12:00:01.5,6,1").into_bytes(), Says(&["line 20", "t_s", "time of day"])),
        ("a sign from a text processor", good.replace(",-", ",−").into_bytes(), Reads(&[])),
        (
            "a comma among decimal points",
            comma.into_bytes(),
            Says(&["line 30", "u_v", "comma", "decimal points"]),
        ),
        (
            "a point among decimal commas",
            point.into_bytes(),
            Says(&["line 30", "u_v", "point", "decimal commas"]),
        ),
        (
            "commas for everything",
            good.replacen("t_s,u_v,omega_rpm", "t_s;u_v;omega_rpm", 1)
                .replace('.', ",")
                .replacen(';', ",", 2)
                .into_bytes(),
            Says(&["decimal signs", "semicolons"]),
        ),
        ("semicolons with points", semicolons.into_bytes(), Reads(&["separated by semicolons"])),
        (
            "too few rows",
            good.lines().take(11).collect::<Vec<_>>().join("\n").into_bytes(),
            Says(&["10 rows", "at least 20"]),
        ),
    ];
    for (what, bytes, expected) in cases {
        check(what, &bytes, "", &expected, &wanted);
    }
}

#[test]
fn the_model_s_supply_and_encoder_complete_a_log() {
    let row = |k: usize| format!("{},{},{}\n", 10 * k, if k % 20 < 10 { 0.5 } else { -0.25 }, 7 * k);
    let text = format!("millis,duty,pos\n{}", (0..40).map(row).collect::<String>());
    let model = truing::system::model::parse(
        "model.toml",
        "schema = \"truing-model/1\"\n[model]\nkind = \"first_order\"\ngain_rad_s_per_v = 16.0\ntime_constant_s = 0.09\n\
         [supply]\nnominal_v = 24\n[encoder]\ncounts_per_rev = 2048\n",
    );
    let columns = |text: &str| Columns::of(text, model.as_ref().unwrap()).unwrap();
    let refused = log::parse_bytes("log.csv", text.as_bytes(), &columns("")).unwrap_err().0;
    assert!(refused.contains("--columns \"theta_rev=pos/2048\""), "{refused}");
    let reading = log::parse_bytes("log.csv", text.as_bytes(), &columns("theta_rev=pos/2048")).unwrap();
    let Log::Dynamic(record) = reading.log else { panic!("a table") };
    assert_eq!(
        (record.runs[0].input[0], record.runs[0].input[10], record.runs[0].t_s[3]),
        (12.0, -6.0, 0.03)
    );
    assert!(reading.notes.iter().any(|note| note.contains("24 V")), "{:?}", reading.notes);
}

#[test]
fn what_counts_the_rows_is_no_speed() {
    let rows = data(9);
    let numbered = |first: usize| {
        let row = |(k, [t, u, w]): (usize, &[String; 3])| format!("{t},{},{u},{w}\n", first + k);
        let text: String = rows.iter().enumerate().map(row).collect();
        format!("t_s,n,u_v,speed\n{text}")
    };
    let error = read(numbered(42).as_bytes(), "").expect_err("a speed without a unit");
    assert!(error.contains("=speed") && !error.contains("=n"), "{error}");
    let steps = numbered(42).replace(",101,", ",140,");
    let error = read(steps.as_bytes(), "").expect_err("two speeds without a unit");
    assert!(error.contains("=n"), "{error}");
}
