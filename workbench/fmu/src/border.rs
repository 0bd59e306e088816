//! The border to C: the functions of FMI 2.0 and 3.0, written from the headers of the standard. The one place with unsafe code.
//!
//! What the standard asks of an importer is what makes it sound: handles come from `…Instantiate…`, are used by one thread at a time and
//! not after `…FreeInstance`; arrays have as many elements as the call says; texts end with 0. Panics end here.

#![allow(unsafe_code, non_snake_case)]
#![allow(missing_docs, clippy::missing_safety_doc, reason = "the standard describes them")]

use crate::description::CATEGORY;
use crate::instance::{Instance, Said, Snapshot, folder};
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::ptr::null_mut;
use std::slice::{from_raw_parts, from_raw_parts_mut};

/// What a call returns, in both versions of the standard.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    Ok = 0,
    Error = 3,
}

/// An instance with its way to the importer's log.
pub struct Handle {
    instance: Instance,
    log: Log,
}

type Pointer = *mut c_void;
type Text = *const c_char;
type Logger2 = unsafe extern "C" fn(Pointer, Text, Status, Text, Text, ...);
type Logger3 = unsafe extern "C" fn(Pointer, Status, Text, Text);

/// The importer's log.
enum Log {
    None,
    Two(Logger2, Pointer, CString),
    Three(Logger3, Pointer),
}

impl Log {
    fn error(&self, message: &str) {
        let text = |text: &str| CString::new(text.replace('\0', " ")).unwrap_or_default();
        let category = text(CATEGORY);
        match self {
            Self::None => {}
            Self::Two(logger, whom, name) => {
                // It is a format of printf.
                let message = text(&message.replace('%', "%%"));
                // SAFETY: the importer gave function and whom for this, and the texts live as long as the call.
                unsafe { logger(*whom, name.as_ptr(), Status::Error, category.as_ptr(), message.as_ptr()) }
            }
            Self::Three(logger, whom) => {
                let message = text(message);
                // SAFETY: as above.
                unsafe { logger(*whom, Status::Error, category.as_ptr(), message.as_ptr()) }
            }
        }
    }
}

/// Does it, and tells the log why it cannot be done.
fn tried<T>(log: impl Fn(&str), act: impl FnOnce() -> Said<T>) -> Option<T> {
    let done = catch_unwind(AssertUnwindSafe(act)).unwrap_or_else(|panic| {
        let why =
            panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
        Err(format!("a fault of the library, please report it: {}", why.unwrap_or("a panic")))
    });
    done.inspect_err(|why| log(why)).ok()
}

/// Does it with an instance.
fn with(handle: *mut Handle, act: impl FnOnce(&mut Instance) -> Said) -> Status {
    // SAFETY: null, or a handle of this library that no other call uses.
    let Some(Handle { instance, log }) = (unsafe { handle.as_mut() }) else { return Status::Error };
    match tried(|why| log.error(why), || act(instance)) {
        Some(()) => Status::Ok,
        None => Status::Error,
    }
}

fn refused(handle: *mut Handle, function: &str) -> Status {
    with(handle, |_| Err(format!("{function} is not offered by this FMU")))
}

/// A new instance as a handle; null if there is none.
fn made(log: Log, resources: Said<PathBuf>, token: Said<String>) -> *mut Handle {
    match tried(|why| log.error(why), || Instance::open(&resources?, &token?)) {
        Some(instance) => Box::into_raw(Box::new(Handle { instance, log })),
        None => null_mut(),
    }
}

/// A text of the importer.
///
/// # Safety
/// Null, or a text that ends with 0.
unsafe fn text(from: Text) -> Said<String> {
    if from.is_null() {
        return Err("a text is missing in a call".into());
    }
    // SAFETY: the caller's word.
    let text = unsafe { CStr::from_ptr(from) };
    text.to_str().map(str::to_owned).map_err(|_| "a text in a call is not UTF-8".into())
}

/// An array of the importer.
///
/// # Safety
/// Null, or so many elements that live as long as the call.
unsafe fn array<'a, T>(from: *const T, count: usize) -> &'a [T] {
    // SAFETY: the caller's word.
    if from.is_null() || count == 0 { &[] } else { unsafe { from_raw_parts(from, count) } }
}

/// The same, to be written to.
///
/// # Safety
/// Null, or so many elements that live as long as the call and that nobody else looks at.
unsafe fn array_mut<'a, T>(to: *mut T, count: usize) -> &'a mut [T] {
    // SAFETY: the caller's word.
    if to.is_null() || count == 0 { &mut [] } else { unsafe { from_raw_parts_mut(to, count) } }
}

/// # Safety
/// As many references and values as the call says.
unsafe fn get(it: *mut Handle, at: *const u32, n: usize, to: *mut f64, count: usize) -> Status {
    // SAFETY: the caller's word.
    let (at, to) = unsafe { (array(at, n), array_mut(to, count)) };
    with(it, |instance| instance.get(at, to))
}

/// # Safety
/// As many references and values as the call says.
unsafe fn set(it: *mut Handle, at: *const u32, n: usize, from: *const f64, count: usize) -> Status {
    // SAFETY: the caller's word.
    let (at, from) = unsafe { (array(at, n), array(from, count)) };
    with(it, |instance| instance.set(at, from))
}

/// What the importer offers in FMI 2.0.
#[repr(C)]
pub struct Callbacks {
    logger: Option<Logger2>,
    /// Memory, its end, and the end of a step.
    others: [Pointer; 3],
    environment: Pointer,
}

/// Functions of C, each under its name or under its names in both versions.
macro_rules! exported {
    ($($($name:ident)+: $arguments:tt -> $out:ty $body:block)*) => {
        $(exported! { @all [$($name)+] $arguments $out $body })*
    };
    (@all [$($name:ident)+] $arguments:tt $out:ty $body:block) => {
        $(exported! { @one $name $arguments $out $body })+
    };
    (@one $name:ident ($($argument:tt: $type:ty),*) $out:ty $body:block) => {
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($argument: $type),*) -> $out $body
    };
}

exported! {
    fmi2GetTypesPlatform: () -> Text { c"default".as_ptr() }
    fmi2GetVersion: () -> Text { c"2.0".as_ptr() }
    fmi3GetVersion: () -> Text { c"3.0".as_ptr() }

    fmi2Instantiate: (
        name: Text, kind: c_int, guid: Text, resources: Text, callbacks: *const Callbacks, _: c_int, _: c_int
    ) -> *mut Handle {
        // SAFETY: texts and callbacks live as long as the call.
        let (name, guid, resources, callbacks) = unsafe { (text(name), text(guid), text(resources), callbacks.as_ref()) };
        let name = CString::new(name.unwrap_or_default()).unwrap_or_default();
        let logger = callbacks.and_then(|it| Some((it.logger?, it.environment)));
        let log = logger.map_or(Log::None, |(logger, environment)| Log::Two(logger, environment, name));
        let resources = resources.and_then(|location| folder(&location));
        let exchange = Err("this FMU is for Co-Simulation; it has no Model Exchange".into());
        made(log, if kind == 1 { resources } else { exchange }, guid)
    }
    fmi3InstantiateCoSimulation: (
        _: Text, token: Text, resources: Text, _: u8, _: u8, _: u8, _: u8, _: *const u32, _: usize, environment: Pointer,
        logger: Option<Logger3>, _: Pointer
    ) -> *mut Handle {
        // SAFETY: the texts live as long as the call.
        let (token, resources) = unsafe { (text(token), text(resources)) };
        let log = logger.map_or(Log::None, |logger| Log::Three(logger, environment));
        made(log, resources.map(PathBuf::from), token)
    }
    fmi3InstantiateModelExchange: (_: Text, _: Text, _: Text, _: u8, _: u8, _: Pointer, _: Pointer) -> *mut Handle { null_mut() }
    fmi3InstantiateScheduledExecution: (
        _: Text, _: Text, _: Text, _: u8, _: u8, _: Pointer, _: Pointer, _: Pointer, _: Pointer, _: Pointer
    ) -> *mut Handle { null_mut() }
    fmi2FreeInstance fmi3FreeInstance: (it: *mut Handle) -> () {
        if !it.is_null() {
            // SAFETY: a handle of this library, for the last time.
            drop(unsafe { Box::from_raw(it) });
        }
    }

    fmi2SetupExperiment: (it: *mut Handle, _: c_int, _: f64, start: f64, _: c_int, _: f64) -> Status {
        with(it, |instance| instance.begin_at(start))
    }
    fmi2EnterInitializationMode: (it: *mut Handle) -> Status { with(it, |_| Ok(())) }
    fmi3EnterInitializationMode: (it: *mut Handle, _: u8, _: f64, start: f64, _: u8, _: f64) -> Status {
        with(it, |instance| instance.begin_at(start))
    }
    fmi2ExitInitializationMode fmi3ExitInitializationMode: (it: *mut Handle) -> Status { with(it, Instance::initialized) }
    fmi2Terminate fmi3Terminate: (it: *mut Handle) -> Status { with(it, Instance::terminate) }
    fmi2Reset fmi3Reset: (it: *mut Handle) -> Status { with(it, Instance::reset) }
    fmi2SetDebugLogging: (it: *mut Handle, _: c_int, _: usize, _: *const Text) -> Status { with(it, |_| Ok(())) }
    fmi3SetDebugLogging: (it: *mut Handle, _: u8, _: usize, _: *const Text) -> Status { with(it, |_| Ok(())) }

    // SAFETY of the next four: as many references and values as the call says.
    fmi2GetReal: (it: *mut Handle, at: *const u32, n: usize, to: *mut f64) -> Status { unsafe { get(it, at, n, to, n) } }
    fmi2SetReal: (it: *mut Handle, at: *const u32, n: usize, from: *const f64) -> Status { unsafe { set(it, at, n, from, n) } }
    fmi3GetFloat64: (it: *mut Handle, at: *const u32, n: usize, to: *mut f64, count: usize) -> Status {
        unsafe { get(it, at, n, to, count) }
    }
    fmi3SetFloat64: (it: *mut Handle, at: *const u32, n: usize, from: *const f64, count: usize) -> Status {
        unsafe { set(it, at, n, from, count) }
    }

    fmi2DoStep: (it: *mut Handle, from: f64, step: f64, _: c_int) -> Status { with(it, |instance| instance.step(from, step)) }
    fmi3DoStep: (
        it: *mut Handle, from: f64, step: f64, _: u8, event: *mut u8, terminate: *mut u8, early: *mut u8, reached: *mut f64
    ) -> Status {
        let done = with(it, |instance| instance.step(from, step));
        // SAFETY: null, or places for one value each.
        unsafe {
            [event, terminate, early].into_iter().filter_map(|flag| flag.as_mut()).for_each(|flag| *flag = 0);
            if let Some(reached) = reached.as_mut() {
                *reached = if done == Status::Ok { from + step } else { from };
            }
        }
        done
    }

    fmi2GetFMUstate fmi3GetFMUState: (it: *mut Handle, kept: *mut *mut Snapshot) -> Status {
        with(it, |instance| {
            // SAFETY: a place for a pointer; where one stands it is a snapshot of this library, and is written over.
            match unsafe { kept.as_mut() }.ok_or("there is no place for a state")? {
                place if place.is_null() => *place = Box::into_raw(Box::new(instance.now.clone())),
                place => unsafe { **place = instance.now.clone() },
            }
            Ok(())
        })
    }
    fmi2SetFMUstate fmi3SetFMUState: (it: *mut Handle, kept: *const Snapshot) -> Status {
        // SAFETY: null, or a snapshot of this library that is not yet free.
        with(it, |instance| unsafe { kept.as_ref() }.map(|kept| instance.now = kept.clone()).ok_or("there is no state".into()))
    }
    fmi2FreeFMUstate fmi3FreeFMUState: (it: *mut Handle, kept: *mut *mut Snapshot) -> Status {
        with(it, |_| {
            // SAFETY: null, or a place with null or a snapshot of this library, for the last time.
            if let Some(place) = unsafe { kept.as_mut() }.filter(|place| !place.is_null()) {
                drop(unsafe { Box::from_raw(std::mem::replace(place, null_mut())) });
            }
            Ok(())
        })
    }
}

/// Functions that have to be there and have nothing to do: no events, no derivatives, no steps in the background.
macro_rules! refusing {
    ($($name:ident($($type:ty),*))*) => {$(
        exported! { @one $name (it: *mut Handle $(, _: $type)*) Status { refused(it, stringify!($name)) } }
    )*};
}

/// Functions of types that no variable has: of no variable they are done.
macro_rules! without_variables {
    (@one $name:ident ($($type:ty),*)) => {
        exported! { @one $name (it: *mut Handle, _: *const u32, count: usize $(, _: $type)*) Status {
            if count == 0 { with(it, |_| Ok(())) } else { refused(it, stringify!($name)) }
        } }
    };
    ($($name:ident)*: $types:tt) => {
        $(without_variables! { @one $name $types })*
    };
}

without_variables! { fmi2GetInteger fmi2GetBoolean fmi2GetString fmi2SetInteger fmi2SetBoolean fmi2SetString: (Pointer) }
without_variables! { fmi2SetRealInputDerivatives fmi2GetRealOutputDerivatives: (Pointer, Pointer) }
without_variables! {
    fmi3GetFloat32 fmi3GetInt8 fmi3GetUInt8 fmi3GetInt16 fmi3GetUInt16 fmi3GetInt32 fmi3GetUInt32 fmi3GetInt64 fmi3GetUInt64
    fmi3GetBoolean fmi3GetString fmi3SetFloat32 fmi3SetInt8 fmi3SetUInt8 fmi3SetInt16 fmi3SetUInt16 fmi3SetInt32 fmi3SetUInt32
    fmi3SetInt64 fmi3SetUInt64 fmi3SetBoolean fmi3SetString: (Pointer, usize)
}
without_variables! { fmi3GetBinary fmi3SetBinary: (Pointer, Pointer, usize) }
without_variables! { fmi3GetClock fmi3SetClock fmi3GetShiftDecimal fmi3SetIntervalDecimal fmi3SetShiftDecimal: (Pointer) }
without_variables! { fmi3GetIntervalDecimal fmi3GetShiftFraction fmi3SetIntervalFraction fmi3SetShiftFraction: (Pointer, Pointer) }
without_variables! { fmi3GetIntervalFraction: (Pointer, Pointer, Pointer) }
without_variables! { fmi3GetOutputDerivatives: (Pointer, Pointer, usize) }

refusing! {
    fmi2SerializedFMUstateSize(Pointer, Pointer) fmi2SerializeFMUstate(Pointer, Pointer, usize)
    fmi2DeSerializeFMUstate(Pointer, usize, Pointer) fmi2CancelStep()
    fmi2GetDirectionalDerivative(Pointer, usize, Pointer, usize, Pointer, Pointer)
    fmi2GetStatus(c_int, Pointer) fmi2GetRealStatus(c_int, Pointer) fmi2GetIntegerStatus(c_int, Pointer)
    fmi2GetBooleanStatus(c_int, Pointer) fmi2GetStringStatus(c_int, Pointer)
    fmi3SerializedFMUStateSize(Pointer, Pointer) fmi3SerializeFMUState(Pointer, Pointer, usize)
    fmi3DeserializeFMUState(Pointer, usize, Pointer) fmi3GetNumberOfVariableDependencies(u32, Pointer)
    fmi3GetVariableDependencies(u32, Pointer, Pointer, Pointer, Pointer, usize)
    fmi3GetDirectionalDerivative(Pointer, usize, Pointer, usize, Pointer, usize, Pointer, usize)
    fmi3GetAdjointDerivative(Pointer, usize, Pointer, usize, Pointer, usize, Pointer, usize)
    fmi3EnterConfigurationMode() fmi3ExitConfigurationMode() fmi3EnterEventMode() fmi3EnterStepMode()
    fmi3EvaluateDiscreteStates() fmi3UpdateDiscreteStates(Pointer, Pointer, Pointer, Pointer, Pointer, Pointer)
    fmi3EnterContinuousTimeMode() fmi3CompletedIntegratorStep(u8, Pointer, Pointer) fmi3SetTime(f64)
    fmi3SetContinuousStates(Pointer, usize) fmi3GetContinuousStateDerivatives(Pointer, usize)
    fmi3GetEventIndicators(Pointer, usize) fmi3GetContinuousStates(Pointer, usize)
    fmi3GetNominalsOfContinuousStates(Pointer, usize) fmi3GetNumberOfEventIndicators(Pointer)
    fmi3GetNumberOfContinuousStates(Pointer) fmi3ActivateModelPartition(u32, f64)
}
