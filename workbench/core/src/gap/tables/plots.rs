//! Curves for the report, in the unit of the reader's table.

use super::map;
use super::rows::Rows;
use super::speed_unit::SpeedUnit;
use crate::outcome::{Curve, Plot, Role, Series, Stage, Style};
use crate::system::plant::physics::Physics;

/// Samples of a drawn map. For display, chosen by judgement.
const SAMPLES: usize = 400;

/// Everything that the plots show.
pub struct Gallery<'a> {
    /// Rows.
    pub data: &'a Rows,
    /// The model as given.
    pub given: &'a Physics,
    /// The extended model.
    pub extended: &'a Physics,
    /// Unit of the speed axis.
    pub unit: SpeedUnit,
    /// Noise, rad/s.
    pub noise: f64,
    /// Edges and knees, V, with labels.
    pub marks: Vec<(f64, String)>,
}

impl Gallery<'_> {
    /// The table beside both models, and what each of them leaves.
    pub fn plots(&self) -> Vec<Plot> {
        vec![self.overview(), self.characterisation(), self.remains()]
    }

    fn characterisation(&self) -> Plot {
        Plot {
            title: "What the model as given leaves".into(),
            caption: "Measured minus simulated over the voltage: the shape tells the kind, the marks where it changes.".into(),
            stage: Stage::Characterisation,
            series: vec![self.residual("measured − model as given", self.given).of(Role::Given)],
            noise_band: Some(self.noise / self.unit.rad_s),
            marks: self.marks.clone(),
            ..self.axes("residual")
        }
    }

    fn overview(&self) -> Plot {
        let mut series = self.measured();
        series.push(self.curve("model as given", self.given, Style::Dashed).of(Role::Given));
        series.push(self.curve("extended model", self.extended, Style::Line).of(Role::Extended));
        Plot {
            title: "Steady speed over voltage".into(),
            caption: "The measurement beside what both models settle at. Hollow points were held out while the effects were chosen.".into(),
            stage: Stage::Overview,
            series,
            marks: self.marks.clone(),
            ..self.axes("speed")
        }
    }

    fn remains(&self) -> Plot {
        Plot {
            title: "What the extended model leaves".into(),
            caption: "Measured minus simulated; the band is the noise that neighbouring rows do not share."
                .into(),
            stage: Stage::Extraction,
            series: vec![self.residual("measured − extended model", self.extended).of(Role::Extended)],
            noise_band: Some(self.noise / self.unit.rad_s),
            ..self.axes("residual")
        }
    }

    fn axes(&self, what: &str) -> Plot {
        Plot {
            x_label: "voltage, V".into(),
            y_label: format!("{what}, {}", self.unit.name),
            ..Plot::default()
        }
    }

    fn measured(&self) -> Vec<Series> {
        let rows = |fitted: bool| {
            let chosen: Vec<usize> =
                (0..self.data.volts.len()).filter(|k| self.data.fitted[*k] == fitted).collect();
            let x = chosen.iter().map(|k| self.data.volts[*k]).collect();
            let y = chosen.iter().map(|k| self.data.omega[*k] / self.unit.rad_s).collect();
            Curve { x, y }
        };
        let fitted = Series::new("measured", rows(true), Style::Points).of(Role::Measured);
        let held = Series::new("measured, held out", rows(false), Style::Hollow).of(Role::Measured);
        if held.curve.x.is_empty() { vec![fitted] } else { vec![fitted, held] }
    }

    /// The map over the range of the table, swept upwards as most tables are.
    fn curve(&self, label: &str, plant: &Physics, style: Style) -> Series {
        let low = self.data.volts.iter().copied().fold(0.0, f64::min);
        let high = self.data.volts.iter().copied().fold(0.0, f64::max);
        let x: Vec<f64> = (0..=SAMPLES).map(|k| low + (high - low) * k as f64 / SAMPLES as f64).collect();
        let y = map::sweep(plant, &x).iter().map(|w| w / self.unit.rad_s).collect();
        Series::new(label, Curve { x, y }, style)
    }

    fn residual(&self, label: &str, plant: &Physics) -> Series {
        let residual = self.data.residual(plant).into_iter();
        let y = residual.map(|error| error / self.unit.rad_s).collect();
        Series::new(label, Curve { x: self.data.volts.clone(), y }, Style::Points)
    }
}
