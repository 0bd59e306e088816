//! The firmware's own log: defmt frames from QEMU's standard output, decoded with the table in the image.

use defmt_decoder::{DecodeError, StreamDecoder, Table};
use std::io::Read;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

/// Lines that the firmware has logged so far.
pub struct FirmwareLog {
    lines: Arc<Mutex<Vec<String>>>,
    thread: Option<JoinHandle<()>>,
}

impl FirmwareLog {
    /// Decodes in the background until the stream ends. An image without a table has no lines.
    pub fn follow(image: &[u8], stream: impl Read + Send + 'static) -> Self {
        let lines = Arc::new(Mutex::new(Vec::new()));
        let table = Table::parse(image).ok().flatten();
        let sink = Arc::clone(&lines);
        let thread = std::thread::spawn(move || match table {
            Some(table) => decode(table.new_stream_decoder().as_mut(), stream, &sink),
            None => drain(stream),
        });
        Self { lines, thread: Some(thread) }
    }

    /// All lines; waits for the stream to end.
    pub fn finish(&mut self) -> Vec<String> {
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        self.lines.lock().map_or_else(|_| Vec::new(), |lines| lines.clone())
    }
}

fn drain(mut stream: impl Read) {
    let _ = std::io::copy(&mut stream, &mut std::io::sink());
}

fn decode(decoder: &mut (dyn StreamDecoder + Send + Sync), mut stream: impl Read, sink: &Mutex<Vec<String>>) {
    let mut buffer = [0; 1024];
    while let Ok(count @ 1..) = stream.read(&mut buffer) {
        decoder.received(&buffer[..count]);
        loop {
            match decoder.decode() {
                Ok(frame) => {
                    let level = frame.level().map_or("", |level| level.as_str());
                    let line = format!("{level} {}", frame.display_message());
                    if let Ok(mut lines) = sink.lock() {
                        lines.push(line);
                    }
                }
                Err(DecodeError::UnexpectedEof) => break,
                Err(DecodeError::Malformed) => {}
            }
        }
    }
}
