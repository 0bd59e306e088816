//! MAT files of version 7.3, which are HDF5.

use crate::mat::{DEEPEST, Variable, Variables};
use hdf5_pure::{AttrValue, DType, Dataset, File, Group};
use truing_core::system::log::cells::Cells;
use truing_core::system::log::{Bytes, Source};
use truing_core::text::input_error::InputError;

/// Files of MATLAB 7.3.
pub struct Mat73;

/// Version and order of bytes in the header of MATLAB, and where they stand.
const MARK: &[u8] = &[0x00, 0x02, b'I', b'M'];
const MARK_AT: usize = 124;
/// What the deflate method makes of a byte at most.
const MOST_INFLATED: u64 = 1032;

impl Source for Mat73 {
    fn takes(&self, _: &str, head: &[u8]) -> bool {
        head.get(MARK_AT..MARK_AT + MARK.len()) == Some(MARK)
    }

    fn table(&self, bytes: Bytes) -> Result<Cells, InputError> {
        let held = crate::held(bytes)?;
        let read = crate::unbroken(|| table(held)).and_then(|it| it);
        read.map_err(|why| {
            let remedy = "if MATLAB reads it, save it with -v7: save('log.mat', '-v7')";
            InputError::file(bytes.name, format!("MAT 7.3 {why}; {remedy}"))
        })
    }
}

fn table(held: Vec<u8>) -> Result<Cells, String> {
    let most = held.len() as u64 * MOST_INFLATED;
    let file = File::from_bytes(held).map_err(|why| format!("cannot be read ({why})"))?;
    let mut variables = Variables::default();
    group(&file.root(), "", most, DEEPEST, &mut variables);
    variables.cells("MAT 7.3")
}

/// The variables of a structure; `outer`: its name.
fn group(group: &Group, outer: &str, most: u64, deeper: usize, into: &mut Variables) {
    let named = |name: &str| if outer.is_empty() { name.to_owned() } else { format!("{outer}.{name}") };
    for name in group.datasets().unwrap_or_default() {
        let read = group.dataset(&name).ok().and_then(|dataset| numbers(&dataset, most));
        match read {
            Some((dims, values)) => into.list.push(Variable { name: named(&name), dims, values }),
            None => into.left_out.push(named(&name)),
        }
    }
    // Names with a hash hold what cells and objects point to.
    for name in group.groups().unwrap_or_default().iter().filter(|name| !name.starts_with('#')) {
        if let Ok(inner) = group.group(name)
            && deeper > 0
        {
            self::group(&inner, &named(name), most, deeper - 1, into);
        }
    }
}

/// The numbers of a variable, and its dimensions as MATLAB has them; `None`: it is a text, a cell or something else.
fn numbers(dataset: &Dataset, most: u64) -> Option<(Vec<usize>, Vec<f64>)> {
    use DType::*;
    let attributes = dataset.attrs().ok()?;
    let class = match attributes.get("MATLAB_class") {
        Some(AttrValue::String(class) | AttrValue::AsciiString(class)) => class.as_str(),
        _ => "",
    };
    let kind = dataset.dtype().ok()?;
    let plain = matches!(kind, F32 | F64 | I8 | I16 | I32 | I64 | U8 | U16 | U32 | U64);
    let shape = dataset.shape().ok()?;
    let count = shape.iter().try_fold(1_u64, |all, length| all.checked_mul(*length))?;
    if !plain || class == "char" || attributes.contains_key("MATLAB_empty") || count > most {
        return None;
    }
    let values = dataset.read_f64().ok()?;
    let dims: Vec<usize> = shape.iter().rev().map(|length| *length as usize).collect();
    (values.len() as u64 == count).then_some((dims, values))
}
