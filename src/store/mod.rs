//! Stored parameters: what survives a power cut, and how it becomes bytes and back.
//!
//! One **record** holds everything that belongs together, so that a reader finds all of an old set or all of a new one.
//! It has a fixed length (little endian):
//!
//! ```text
//! 0      4        6        8                                   RECORD_LEN − 4
//! │ epoch │ layout │ length │ postcard of the set … zero padding │ CRC-32 │
//! ```
//!
//! - *epoch* orders the flash sectors (see [`crate::drivers::flash`]); inside a sector the later record is the newer.
//! - *layout* numbers the shape of the set. A reader migrates the layouts that it knows and reports every other one:
//!   bytes are never guessed at.
//! - *CRC-32* (IEEE 802.3) covers all that stands before it. The flash library underneath checks the same bytes with a
//!   different polynomial (Castagnoli), so random bits pass both with a probability of 2⁻⁶⁴.

pub(crate) mod checksum;
mod event;
mod layouts;

pub use event::{SaveError, StoreEvent};

use crate::compensate::modelled::Modelled;
use crate::compensate::position_load::PositionLoad;
use crate::config::{Config, ConfigError, Field, LATEST, within};
use crate::control::Tuning;
use crate::identify::estimate::Estimates;
use crate::protect::{self, Settings, SettingsError};
use crate::sample::Bridge;
use crate::store::checksum::CHECKSUM;
use serde::{Deserialize, Deserializer, Serialize};

/// Axes that one record has room for. An image that drives more needs a longer record, which is another layout.
pub const MAX_AXES: usize = 4;
/// Bytes of a record. Four axes take up to 625 bytes in postcard ([`Estimates::to_store`] sees to it), each sine of a table of the
/// load 6 more, a lag of 8 ticks or more 1 or 2, a share of the torque 4, a skew or a drag up to 9,
/// as much again what tells of dry friction, and what is doubted 2.
pub const RECORD_LEN: usize = 640;
/// Layout since which a record has all that a model tells, which is no setting.
const WITH_MODEL: u16 = 9;
/// Layout that this image writes: that of the newest setting, or of what else a record holds.
pub const LAYOUT: u16 = if LATEST > WITH_MODEL { LATEST } else { WITH_MODEL };

const HEADER_LEN: usize = 8;
const PAYLOAD_END: usize = RECORD_LEN - 4;

/// Everything about one axis that must not be asked or measured again after power-up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisParameters {
    /// What the user said.
    pub config: Config,
    /// What was identified; the gains of the loops follow from it.
    pub estimates: Estimates,
    /// What the user chose about the loops.
    pub tuning: Tuning,
    /// Use the inverse dead zone in the loops.
    pub compensation: bool,
    /// What the user chose about protection.
    pub protection: Settings,
    /// The load over the place; none before layout 5, and in texts of that time.
    #[serde(default)]
    pub position_load: PositionLoad,
    /// What a model tells; nothing before layout 6, only a lag before layout 7, with load friction before layout 8, without
    /// doubts before layout 9.
    #[serde(default)]
    pub modelled: Modelled,
}

/// A set of parameters. A function of its own: within that of the commands it would take twice the room in an image.
#[inline(never)]
pub(crate) fn deserialize_set<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<AxisParameters, D::Error> {
    AxisParameters::deserialize(deserializer)
}

impl AxisParameters {
    /// Of an axis about which nothing but its configuration is known or chosen.
    #[must_use]
    pub fn new(config: Config) -> Self {
        Self {
            config,
            estimates: Estimates::default(),
            tuning: Tuning::default(),
            compensation: true,
            protection: Settings::default(),
            position_load: PositionLoad::default(),
            modelled: Modelled::default(),
        }
    }

    /// Can an axis be built from them?
    pub fn check(&self) -> Result<(), SettingsError> {
        self.within_range().map_err(SettingsError::Value)?;
        let scale = self.config.build().map_err(SettingsError::Value)?;
        protect::Params::new(&scale, &self.protection).map(|_| ())
    }

    /// What neither configuration nor protection will look at.
    pub(crate) fn within_range(&self) -> Result<(), ConfigError> {
        let (low, high) = Tuning::BANDWIDTHS;
        within(Field::Bandwidth, self.tuning.bandwidth, low, high)?;
        self.position_load.check()?;
        self.estimates.check()
    }
}

/// The set: saved and loaded as a whole. `AXES`: how many it has room for; an image has no more than it drives.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StoredParameters<const AXES: usize = MAX_AXES> {
    /// One entry an axis, in the order of the axes; `None`: that axis was not configured.
    pub axes: heapless::Vec<Option<AxisParameters>, AXES>,
}

/// Proof that a set may be written: flash programming stalls the processor, so nothing may move and nothing may drive.
#[derive(Clone, Copy, Debug)]
pub struct AtRest(());

impl AtRest {
    /// The proof, if the bridge is off and the shaft stands.
    pub fn check(bridge: Bridge, standing: bool) -> Option<Self> {
        (bridge == Bridge::Open && standing).then_some(AtRest(()))
    }
}

/// What was found at power-up. Everything but [`Loaded::Set`] asks for commissioning.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "there is no heap to box the set")]
pub enum Loaded {
    /// A set. `layout` below [`LAYOUT`]: it was migrated from there, and the next save writes it anew.
    Set {
        /// The set.
        parameters: StoredParameters,
        /// Layout in which it was stored.
        layout: u16,
    },
    /// Nothing was ever stored.
    Blank,
    /// An intact record that this image cannot read: written by a newer image, or outside this image's ranges.
    Unreadable {
        /// Layout in which it was stored.
        layout: u16,
    },
    /// The flash holds something, but no intact record.
    Damaged,
}

/// [`Loaded`] in short, for a report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Found {
    /// A set, which is in force.
    Set {
        /// Layout in which it was stored.
        layout: u16,
    },
    /// Nothing was ever stored.
    #[default]
    Blank,
    /// An intact record that this image cannot use.
    Unreadable {
        /// Layout in which it was stored.
        layout: u16,
    },
    /// No intact record.
    Damaged,
}

impl Loaded {
    /// What was found, with the set.
    pub(crate) fn new(found: Found, parameters: StoredParameters) -> Self {
        match found {
            Found::Set { layout } => Loaded::Set { parameters, layout },
            Found::Blank => Loaded::Blank,
            Found::Unreadable { layout } => Loaded::Unreadable { layout },
            Found::Damaged => Loaded::Damaged,
        }
    }
}

/// A record whose checksum is right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record<'a> {
    /// Orders the sectors.
    pub epoch: u32,
    /// Shape of the payload.
    pub layout: u16,
    payload: &'a [u8],
}

impl<'a> Record<'a> {
    /// Checks length and checksum; `None`: not a record.
    pub fn parse(bytes: &'a [u8]) -> Option<Self> {
        let bytes: &[u8; RECORD_LEN] = bytes.try_into().ok()?;
        let (covered, checksum) = bytes.split_at(PAYLOAD_END);
        if CHECKSUM.checksum(covered).to_le_bytes() != checksum {
            return None;
        }
        let (header, payload) = covered.split_at(HEADER_LEN);
        let length = usize::from(u16::from_le_bytes([header[6], header[7]]));
        Some(Record {
            epoch: u32::from_le_bytes([header[0], header[1], header[2], header[3]]),
            layout: u16::from_le_bytes([header[4], header[5]]),
            payload: payload.get(..length)?,
        })
    }

    /// The set, migrated to the present layout if need be.
    pub fn load(&self) -> Loaded {
        let mut parameters = StoredParameters::default();
        let found = self.load_into(&mut parameters);
        Loaded::new(found, parameters)
    }

    /// Decodes the set into the place where it is to stay, which is empty if this image cannot read it.
    pub fn load_into<const AXES: usize>(&self, set: &mut StoredParameters<AXES>) -> Found {
        let layout = self.layout;
        set.axes.clear();
        if self.migrate(set).is_some() && set.is_valid() {
            return Found::Set { layout };
        }
        set.axes.clear();
        Found::Unreadable { layout }
    }

    /// Decodes one axis after the other into its place, so that the stack holds one and not four, and insists that nothing
    /// is left over: no axis that was configured and has no place here. In postcard a sequence is its length and its items.
    #[inline(never)]
    fn migrate<const AXES: usize>(&self, set: &mut StoredParameters<AXES>) -> Option<()> {
        let mut rest = self.payload;
        let axes = layouts::take::<u32>(&mut rest)?;
        if axes as usize > MAX_AXES {
            return None;
        }
        for _ in 0..axes {
            let axis = match self.layout {
                1..=LAYOUT => layouts::axis(self.layout, &mut rest)?,
                _ => return None,
            };
            if let Err(Some(_)) = set.axes.push(axis) {
                return None;
            }
        }
        rest.is_empty().then_some(())
    }
}

/// The record of a set.
pub fn encode(set: &impl Serialize, epoch: u32, layout: u16) -> Result<[u8; RECORD_LEN], postcard::Error> {
    let mut bytes = [0; RECORD_LEN];
    encode_into(&mut bytes, set, epoch, layout)?;
    Ok(bytes)
}

/// Writes the record of a set over whatever the bytes were.
pub(crate) fn encode_into(
    bytes: &mut [u8; RECORD_LEN],
    set: &impl Serialize,
    epoch: u32,
    layout: u16,
) -> Result<(), postcard::Error> {
    bytes.fill(0);
    let length = postcard::to_slice(set, &mut bytes[HEADER_LEN..PAYLOAD_END])?.len();
    bytes[..4].copy_from_slice(&epoch.to_le_bytes());
    bytes[4..6].copy_from_slice(&layout.to_le_bytes());
    bytes[6..HEADER_LEN].copy_from_slice(&(length as u16).to_le_bytes());
    let checksum = CHECKSUM.checksum(&bytes[..PAYLOAD_END]);
    bytes[PAYLOAD_END..].copy_from_slice(&checksum.to_le_bytes());
    Ok(())
}

impl<const AXES: usize> StoredParameters<AXES> {
    /// Can an axis be built from every entry?
    fn is_valid(&self) -> bool {
        self.axes.iter().flatten().all(|axis| axis.check().is_ok())
    }
}
