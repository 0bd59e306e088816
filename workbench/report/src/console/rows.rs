//! What is read of a log: options that several subcommands share.

use clap::Args;
use truing_core::system::log::Columns;
use truing_core::system::model::Model;
use truing_core::text::input_error::InputError;

/// What is read of a log.
#[derive(Args, Debug, Clone, Default)]
pub struct Rows {
    /// What the columns of the logs are, where their names do not say it: `u_v=pwm/255*12,t_ms=time,omega_rpm=left_rpm`. The
    /// right side is a column, an expression over columns and `row`, or a constant; `NAME=none` leaves a column out
    /// (`t_s=none`: a steady-state table). Without it, `[log] columns` of the model holds. `truing look` proposes it.
    #[arg(long, value_name = "OURS=THEIRS,…", default_value = "", hide_default_value = true)]
    pub columns: String,
    /// Read the log from this time on, s, as `truing look` shows it.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub from: Option<f64>,
    /// Read the log up to this time, s.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub to: Option<f64>,
}

impl Rows {
    /// The columns of all logs, and the part of the first one.
    pub fn read(&self, model: Option<&Model>) -> Result<Columns, InputError> {
        if let (Some(from), Some(to)) = (self.from, self.to)
            && from >= to
        {
            return Err(InputError(format!("--from {from} s is not before --to {to} s")));
        }
        let columns =
            model.map_or_else(|| self.columns.parse(), |model| Columns::of(&self.columns, model))?;
        Ok(columns.cropped(self.from, self.to))
    }
}
