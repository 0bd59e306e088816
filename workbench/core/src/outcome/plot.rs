//! What the pictures of a result hold; a report draws them.

/// A sampled curve for plots.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// Abscissa.
    pub x: Vec<f64>,
    /// Ordinate.
    pub y: Vec<f64>,
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
        let label = label.into();
        Self { label, curve, style, role: None }
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
