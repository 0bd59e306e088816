//! The border to C: the functions of FMI 2.0 and 3.0, written from the headers of the standard. The one place with unsafe code.
//!
//! What the standard asks of an importer is what makes it sound: handles come from `…Instantiate…`, are used by one thread at a time and
//! not after `…FreeInstance`; arrays have as many elements as the call says; texts end with 0. Panics end here.

#![allow(unsafe_code, non_snake_case)]
#![allow(missing_docs, reason = "the standard describes them")]

use crate::description::CATEGORY;
use crate::instance::{Instance, Said, Snapshot, folder};
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
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
            Self::Two(logger, environment, name) => {
                // It is a format of printf.
                let message = text(&message.replace('%', "%%"));
                // SAFETY: the importer gave function and environment for this, and the texts live as long as the call.
                unsafe {
                    logger(*environment, name.as_ptr(), Status::Error, category.as_ptr(), message.as_ptr())
                }
            }
            Self::Three(logger, environment) => {
                let message = text(message);
                // SAFETY: as above.
                unsafe { logger(*environment, Status::Error, category.as_ptr(), message.as_ptr()) }
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
fn made(
    log: Log,
    resources: impl FnOnce() -> Said<PathBuf>,
    token: impl FnOnce() -> Said<String>,
) -> *mut Handle {
    match tried(|why| log.error(why), || Instance::open(&resources()?, token()?.as_str())) {
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

/// What both versions have under names of their own.
macro_rules! shared {
    ($get:ident $set:ident ($($count:ident)?); $free:ident $exit:ident $terminate:ident $reset:ident;
     $keep:ident $restore:ident $drop:ident; $debug:ident($flag:ty);) => {
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(it: *mut Handle, at: *const u32, n: usize, to: *mut f64 $(, $count: usize)?) -> Status {
            // SAFETY: as many references and values as the call says.
            let (at, to) = unsafe { (array(at, n), array_mut(to, [n $(, $count)?].into_iter().last().unwrap_or(n))) };
            with(it, |instance| instance.get(at, to))
        }
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(it: *mut Handle, at: *const u32, n: usize, from: *const f64 $(, $count: usize)?) -> Status {
            // SAFETY: as many references and values as the call says.
            let (at, from) = unsafe { (array(at, n), array(from, [n $(, $count)?].into_iter().last().unwrap_or(n))) };
            with(it, |instance| instance.set(at, from))
        }
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $free(it: *mut Handle) {
            if !it.is_null() {
                // SAFETY: a handle of this library, for the last time.
                drop(unsafe { Box::from_raw(it) });
            }
        }
        #[unsafe(no_mangle)]
        pub extern "C" fn $exit(it: *mut Handle) -> Status {
            with(it, Instance::initialized)
        }
        #[unsafe(no_mangle)]
        pub extern "C" fn $terminate(it: *mut Handle) -> Status {
            with(it, |instance| Ok(instance.terminate()))
        }
        #[unsafe(no_mangle)]
        pub extern "C" fn $reset(it: *mut Handle) -> Status {
            with(it, |instance| Ok(instance.reset()))
        }
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $keep(it: *mut Handle, kept: *mut *mut Snapshot) -> Status {
            with(it, |instance| {
                // SAFETY: a place for a pointer; where one stands it is a snapshot of this library, and is written over.
                unsafe {
                    match kept.as_mut().ok_or("there is no place for a state")? {
                        place if place.is_null() => *place = Box::into_raw(Box::new(instance.snapshot())),
                        place => **place = instance.snapshot(),
                    }
                }
                Ok(())
            })
        }
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $restore(it: *mut Handle, kept: *const Snapshot) -> Status {
            // SAFETY: null, or a snapshot of this library that is not yet free.
            with(it, |instance| Ok(instance.restore(unsafe { kept.as_ref() }.ok_or("there is no state")?)))
        }
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $drop(it: *mut Handle, kept: *mut *mut Snapshot) -> Status {
            with(it, |_| {
                // SAFETY: null, or a place with null or a snapshot of this library, for the last time.
                unsafe {
                    if let Some(place) = kept.as_mut().filter(|place| !place.is_null()) {
                        drop(Box::from_raw(std::mem::replace(place, null_mut())));
                    }
                }
                Ok(())
            })
        }
        #[unsafe(no_mangle)]
        pub extern "C" fn $debug(it: *mut Handle, _: $flag, _: usize, _: *const Text) -> Status {
            with(it, |_| Ok(()))
        }
    };
}

shared! {
    fmi2GetReal fmi2SetReal();
    fmi2FreeInstance fmi2ExitInitializationMode fmi2Terminate fmi2Reset;
    fmi2GetFMUstate fmi2SetFMUstate fmi2FreeFMUstate;
    fmi2SetDebugLogging(c_int);
}
shared! {
    fmi3GetFloat64 fmi3SetFloat64(values);
    fmi3FreeInstance fmi3ExitInitializationMode fmi3Terminate fmi3Reset;
    fmi3GetFMUState fmi3SetFMUState fmi3FreeFMUState;
    fmi3SetDebugLogging(u8);
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> Text {
    c"default".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> Text {
    c"2.0".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> Text {
    c"3.0".as_ptr()
}

/// What the importer offers in FMI 2.0.
#[repr(C)]
pub struct Callbacks {
    logger: Option<Logger2>,
    allocate: Pointer,
    free: Pointer,
    step_finished: Pointer,
    environment: Pointer,
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    name: Text,
    kind: c_int,
    guid: Text,
    resources: Text,
    callbacks: *const Callbacks,
    _visible: c_int,
    _logging: c_int,
) -> *mut Handle {
    // SAFETY: texts and callbacks live as long as the call.
    let (name, guid, resources, callbacks) =
        unsafe { (text(name).unwrap_or_default(), text(guid), text(resources), callbacks.as_ref()) };
    let log = match callbacks.and_then(|it| Some((it.logger?, it.environment))) {
        Some((logger, environment)) => Log::Two(logger, environment, CString::new(name).unwrap_or_default()),
        None => Log::None,
    };
    if kind != 1 {
        log.error("this FMU is for Co-Simulation; it has no Model Exchange");
        return null_mut();
    }
    made(log, || folder(&resources?), || guid)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    _name: Text,
    token: Text,
    resources: Text,
    _visible: u8,
    _logging: u8,
    _events: u8,
    _early_return: u8,
    _intermediate: *const u32,
    _count: usize,
    environment: Pointer,
    logger: Option<Logger3>,
    _update: Pointer,
) -> *mut Handle {
    // SAFETY: the texts live as long as the call.
    let (token, resources) = unsafe { (text(token), text(resources)) };
    let log = logger.map_or(Log::None, |logger| Log::Three(logger, environment));
    made(log, || Ok(Path::new(&resources?).to_owned()), || token)
}

/// Instances of a kind that this FMU is not.
macro_rules! never {
    ($($name:ident($($type:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $name($(_: $type),*) -> *mut Handle {
            null_mut()
        }
    )*};
}

never! {
    fmi3InstantiateModelExchange(Text, Text, Text, u8, u8, Pointer, Pointer);
    fmi3InstantiateScheduledExecution(Text, Text, Text, u8, u8, Pointer, Pointer, Pointer, Pointer, Pointer);
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetupExperiment(
    it: *mut Handle,
    _: c_int,
    _: f64,
    start: f64,
    _: c_int,
    _: f64,
) -> Status {
    with(it, |instance| instance.begin_at(start))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2EnterInitializationMode(it: *mut Handle) -> Status {
    with(it, |_| Ok(()))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterInitializationMode(
    it: *mut Handle,
    _: u8,
    _: f64,
    start: f64,
    _: u8,
    _: f64,
) -> Status {
    with(it, |instance| instance.begin_at(start))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2DoStep(it: *mut Handle, from: f64, step: f64, _: c_int) -> Status {
    with(it, |instance| instance.step(from, step))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    it: *mut Handle,
    from: f64,
    step: f64,
    _: u8,
    event: *mut u8,
    terminate: *mut u8,
    early: *mut u8,
    reached: *mut f64,
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

/// Functions that have to be there and have nothing to do: no other types, no events, no steps in the background.
macro_rules! refusing {
    ($($name:ident($($type:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(it: *mut Handle $(, _: $type)*) -> Status {
            refused(it, stringify!($name))
        }
    )*};
}

/// Functions of types that no variable has: of no variable they are done.
macro_rules! without_variables {
    (@one $name:ident ($($type:ty),*)) => {
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(it: *mut Handle, _: *const u32, count: usize $(, _: $type)*) -> Status {
            if count == 0 { with(it, |_| Ok(())) } else { refused(it, stringify!($name)) }
        }
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
    fmi2SerializedFMUstateSize(Pointer, Pointer);
    fmi2SerializeFMUstate(Pointer, Pointer, usize);
    fmi2DeSerializeFMUstate(Pointer, usize, Pointer);
    fmi2GetDirectionalDerivative(Pointer, usize, Pointer, usize, Pointer, Pointer);
    fmi2CancelStep();
    fmi2GetStatus(c_int, Pointer);
    fmi2GetRealStatus(c_int, Pointer);
    fmi2GetIntegerStatus(c_int, Pointer);
    fmi2GetBooleanStatus(c_int, Pointer);
    fmi2GetStringStatus(c_int, Pointer);
    fmi3SerializedFMUStateSize(Pointer, Pointer);
    fmi3SerializeFMUState(Pointer, Pointer, usize);
    fmi3DeserializeFMUState(Pointer, usize, Pointer);
    fmi3GetNumberOfVariableDependencies(u32, Pointer);
    fmi3GetVariableDependencies(u32, Pointer, Pointer, Pointer, Pointer, usize);
    fmi3GetDirectionalDerivative(Pointer, usize, Pointer, usize, Pointer, usize, Pointer, usize);
    fmi3GetAdjointDerivative(Pointer, usize, Pointer, usize, Pointer, usize, Pointer, usize);
    fmi3EnterConfigurationMode();
    fmi3ExitConfigurationMode();
    fmi3EnterEventMode();
    fmi3EnterStepMode();
    fmi3EvaluateDiscreteStates();
    fmi3UpdateDiscreteStates(Pointer, Pointer, Pointer, Pointer, Pointer, Pointer);
    fmi3EnterContinuousTimeMode();
    fmi3CompletedIntegratorStep(u8, Pointer, Pointer);
    fmi3SetTime(f64);
    fmi3SetContinuousStates(Pointer, usize);
    fmi3GetContinuousStateDerivatives(Pointer, usize);
    fmi3GetEventIndicators(Pointer, usize);
    fmi3GetContinuousStates(Pointer, usize);
    fmi3GetNominalsOfContinuousStates(Pointer, usize);
    fmi3GetNumberOfEventIndicators(Pointer);
    fmi3GetNumberOfContinuousStates(Pointer);
    fmi3ActivateModelPartition(u32, f64);
}
