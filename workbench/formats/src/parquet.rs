//! Parquet.

use crate::arrow;
use ::parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use bytes::Bytes as Held;
use truing_core::system::log::cells::Cells;
use truing_core::system::log::{Bytes, Source};
use truing_core::text::input_error::InputError;

/// Tables as Parquet: LeRobot, pandas, Polars, Spark.
pub struct Parquet;

/// How such a file begins and ends.
const MAGIC: &[u8] = b"PAR1";
/// Rows that are decoded at once.
const ROWS: usize = 1 << 14;

impl Source for Parquet {
    fn takes(&self, _: &str, head: &[u8]) -> bool {
        head.starts_with(MAGIC)
    }

    fn table(&self, bytes: Bytes) -> Result<Cells, InputError> {
        let wrong = |what: String| InputError::file(bytes.name, what);
        // Its table of contents stands at the end.
        let held = crate::held(bytes)?;
        if !held.ends_with(MAGIC) {
            let what = "is cut: the table of contents at its end is missing, without which nothing can be read; copy it anew";
            return Err(InputError::at(bytes.name, format!("byte {}", held.len()), what));
        }
        crate::unbroken(|| batches(held.into())).and_then(|it| it).map_err(wrong)
    }
}

fn batches(held: Held) -> Result<Cells, String> {
    let broken =
        |rows: usize| move |why| format!("is broken at row {} ({why}); write the file anew", rows + 1);
    let opened = ParquetRecordBatchReaderBuilder::try_new(held);
    let reader = opened.and_then(|builder| builder.with_batch_size(ROWS).build());
    let mut batches = Vec::new();
    let (mut rows, mut told) = (0, Vec::new());
    for batch in reader.map_err(|why| format!("is no Parquet that can be read ({why})"))? {
        match batch {
            Ok(batch) => {
                rows += batch.num_rows();
                batches.push(batch);
            }
            Err(why) if rows == 0 => return Err(broken(rows)(why.to_string())),
            Err(why) => {
                told.push(format!(
                    "The file is broken at row {} ({why}): what stands before it is read.",
                    rows + 1
                ));
                break;
            }
        }
    }
    arrow::written(&batches, "Parquet", told)
}
