//! The servo as a whole around simulated motors: control, commissioning, passive identification, protection, motion.

mod ahead;
mod axis;
mod commission;
mod commission_flaws;
mod current_limit;
mod excitation;
mod false_alarms;
mod families;
mod faults;
mod first_motion;
mod identify_passive;
mod imperfections;
mod injected;
mod limits;
mod modelled;
mod position_load;
mod rates;
mod record;
mod referencing;
mod shortage;
mod starts;
mod stream;
mod tracking;
