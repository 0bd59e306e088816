//! What the pictures of a result hold; a report draws them.

/// A sampled curve for plots.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// Abscissa.
    pub x: Vec<f64>,
    /// Ordinate.
    pub y: Vec<f64>,
}

impl Curve {
    /// Means of the points over so many bins, each of as many points.
    pub fn binned(mut points: Vec<(f64, f64)>, bins: usize) -> Self {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let bins = points.chunks(points.len().div_ceil(bins).max(1));
        let mean = |bin: &[(f64, f64)], value: fn(&(f64, f64)) -> f64| {
            bin.iter().map(value).sum::<f64>() / bin.len() as f64
        };
        let (x, y) = bins.map(|bin| (mean(bin, |it| it.0), mean(bin, |it| it.1))).unzip();
        Self { x, y }
    }
}

/// The chapters of a report: what it comes to, and the three stages of nonlinear identification.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    /// What was measured beside both models: the first picture that a reader sees.
    Overview,
    /// Is something missing, and where does it show?
    #[default]
    Detection,
    /// What is it?
    Characterisation,
    /// How large is it, and what does that explain?
    Extraction,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Style {
    /// A solid line: a simulation.
    #[default]
    Line,
    /// A dashed line: the model as given, or a reference.
    Dashed,
    /// Points: a measurement.
    Points,
    /// Hollow points: measured, but held out.
    Hollow,
}

/// Whom a curve speaks of: it has one colour on every plot of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// What was measured.
    Measured,
    /// The model as given.
    Given,
    /// The extended model.
    Extended,
    /// Any other, by number.
    Further(usize),
}

/// One curve of a plot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Legend entry.
    pub label: String,
    /// The samples. A value that is not finite leaves a break in the line.
    pub curve: Curve,
    /// How it is drawn.
    pub style: Style,
    /// Whom it speaks of; `None`: the next colour.
    pub role: Option<Role>,
}

impl Series {
    /// A curve with its legend entry.
    pub fn new(label: &str, curve: Curve, style: Style) -> Self {
        Self { label: label.into(), curve, style, role: None }
    }

    /// The same curve, which speaks of this.
    pub fn of(self, role: Role) -> Self {
        Self { role: Some(role), ..self }
    }
}

/// Curves on axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    /// Title.
    pub title: String,
    /// What a reader should see in it, in a sentence.
    pub caption: String,
    /// The chapter it belongs to.
    pub stage: Stage,
    /// Abscissa with unit.
    pub x_label: String,
    /// Ordinate with unit.
    pub y_label: String,
    /// The curves.
    pub series: Vec<Series>,
    /// A horizontal band of this half-width around zero (residual plots): the noise.
    pub noise_band: Option<f64>,
    /// Vertical marks with a label: the edge of a dead zone, a knee.
    pub marks: Vec<(f64, String)>,
    /// Stretches of the abscissa that were held out.
    pub held_out: Vec<(f64, f64)>,
}
