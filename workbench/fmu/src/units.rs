//! Units of the library of effects as exponents of the SI base units: importers check that what they connect fits.

/// The base units of the standard that occur, with the names of their attributes.
pub const BASE: [&str; 6] = ["kg", "m", "s", "A", "K", "rad"];

/// Exponents of [`BASE`].
pub type Exponents = [i8; 6];

/// Symbol and exponents of what the units are made of.
#[rustfmt::skip]
const ATOMS: [(&str, Exponents); 13] = [
    ("1", [0; 6]), ("kg", [1, 0, 0, 0, 0, 0]), ("m", [0, 1, 0, 0, 0, 0]), ("s", [0, 0, 1, 0, 0, 0]), ("A", [0, 0, 0, 1, 0, 0]),
    ("rad", [0, 0, 0, 0, 0, 1]), ("Hz", [0, 0, -1, 0, 0, 0]), ("N", [1, 1, -2, 0, 0, 0]), ("W", [1, 2, -3, 0, 0, 0]),
    ("V", [1, 2, -3, -1, 0, 0]), ("Ω", [1, 2, -3, -2, 0, 0]), ("H", [1, 2, -2, -2, 0, 0]), ("F", [-1, -2, 4, 2, 0, 0]),
];

/// Exponents of a unit such as `N m s²/rad²`; `None`: it is in words.
pub fn exponents(unit: &str) -> Option<Exponents> {
    let mut sum = [0; 6];
    for (place, part) in unit.split('/').enumerate() {
        let sign = if place == 0 { 1 } else { -1 };
        for factor in part.split_whitespace() {
            let (symbol, power) = match factor.char_indices().last()? {
                (at, '²') => (&factor[..at], 2),
                (at, '³') => (&factor[..at], 3),
                _ => (factor, 1),
            };
            let (_, atom) = ATOMS.iter().find(|(name, _)| *name == symbol)?;
            sum.iter_mut().zip(atom).for_each(|(sum, exponent)| *sum += sign * power * exponent);
        }
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use truing_core::system::effects::{LIBRARY, linear_unit};

    #[test]
    fn units_are_products_of_base_units() {
        assert_eq!(exponents("N m s/rad"), Some([1, 2, -1, 0, 0, -1]));
        assert_eq!(exponents("V s/rad"), Some([1, 2, -2, -1, 0, -1]));
        assert_eq!(exponents("N m or N per unit of input"), None);
    }

    #[test]
    fn every_unit_of_the_library_is_understood() {
        for parameter in LIBRARY.iter().flat_map(|effect| effect.parameters) {
            let units = [parameter.unit.to_owned(), linear_unit(parameter.unit)];
            for unit in units {
                assert!(exponents(&unit).is_some(), "{unit}");
            }
        }
    }
}
