//! USART2 or USART3 as the link: 921,600 baud, 8N1, both directions by DMA. Nothing waits and no byte interrupts anybody: the link
//! task looks after every control tick.
//!
//! Received bytes go round a ring of 512, which lasts 5.5 ms at full speed, more than five of the slowest ticks.
//! Sent bytes wait in a queue of 1,024, of which the DMA takes one contiguous piece at a time.

use super::super::Line;
use super::board::Link;
use super::pac::{DMA1, USART2, USART3, usart1::RegisterBlock};
use super::timing;
use core::sync::atomic::{AtomicU8, Ordering, compiler_fence};
use heapless::Deque;

/// 42 MHz / 46 = 913,043, 0.9 % slow: inside the 3 % of a receiver (RM0090 section 30.3.5).
const BAUD: u32 = 921_600;
/// Of both ports, both directions (RM0090 table 42).
const CHANNEL: u8 = 4;

const RING: usize = 512;
const QUEUE: usize = 1024;

/// Written by the DMA alone, hence atomic.
static RECEIVED: [AtomicU8; RING] = [const { AtomicU8::new(0) }; RING];

/// Streams of DMA1 that serve a port, each 0 … 7.
#[derive(Clone, Copy)]
struct Streams {
    receive: usize,
    transmit: usize,
}

/// Registers and streams of a port (RM0090 table 42).
fn port(link: Link) -> (&'static RegisterBlock, Streams) {
    let (address, streams) = match link {
        Link::Usart2 => (USART2::ptr(), Streams { receive: 5, transmit: 6 }),
        Link::Usart3 => (USART3::ptr(), Streams { receive: 1, transmit: 3 }),
    };
    // SAFETY: valid for the life of the program, and nobody else uses the port.
    (unsafe { &*address }, streams)
}

impl Streams {
    /// Those of the transmission, before its next piece. Streams 0 to 3 have them in LIFCR, 4 to 7 in HIFCR (RM0090 section
    /// 10.5.3).
    fn clear_flags(self, dma: &DMA1) {
        if self.transmit < 4 {
            dma.lifcr().write(|w| {
                w.ctcif3().set_bit().chtif3().set_bit();
                w.cteif3().set_bit().cdmeif3().set_bit().cfeif3().set_bit()
            });
        } else {
            dma.hifcr().write(|w| {
                w.ctcif6().set_bit().chtif6().set_bit();
                w.cteif6().set_bit().cdmeif6().set_bit().cfeif6().set_bit()
            });
        }
    }
}

/// The link. It must stay in place once it has sent a byte; as a local resource of a task it does.
pub struct SerialLine {
    dma: DMA1,
    streams: Streams,
    read: usize,
    queue: Deque<u8, QUEUE>,
    in_flight: usize,
}

impl SerialLine {
    /// Starts the receiver.
    pub fn start(link: Link, dma: DMA1) -> Self {
        let (usart, streams) = port(link);
        let peripheral = usart.dr().as_ptr() as u32;
        let receive = dma.st(streams.receive);
        // SAFETY: the addresses are those of the data register and of a static; lengths match.
        unsafe {
            receive.par().write(|w| w.bits(peripheral));
            receive.m0ar().write(|w| w.bits(RECEIVED.as_ptr() as u32));
            dma.st(streams.transmit).par().write(|w| w.bits(peripheral));
        }
        receive.ndtr().write(|w| w.ndt().set(RING as u16));
        receive.cr().write(|w| {
            w.chsel().set(CHANNEL).dir().peripheral_to_memory();
            w.minc().set_bit().circ().set_bit().en().set_bit()
        });
        let divisor = timing::baud_divisor(timing::APB1_HZ, BAUD);
        // SAFETY: any 16-bit divisor of at least 16 is defined.
        usart.brr().write(|w| unsafe { w.bits(divisor) });
        usart.cr3().write(|w| w.dmat().set_bit().dmar().set_bit());
        usart.cr1().write(|w| w.ue().set_bit().te().set_bit().re().set_bit());
        Self { dma, streams, read: 0, queue: Deque::new(), in_flight: 0 }
    }

    /// Forgets what has been sent and starts the next piece.
    fn pump(&mut self) {
        let stream = self.dma.st(self.streams.transmit & 7);
        if stream.cr().read().en().bit_is_set() {
            return;
        }
        for _ in 0..self.in_flight {
            let _ = self.queue.pop_front();
        }
        let (piece, _) = self.queue.as_slices();
        self.in_flight = piece.len();
        if piece.is_empty() {
            return;
        }
        // The piece must be in memory before the DMA reads it.
        compiler_fence(Ordering::Release);
        self.streams.clear_flags(&self.dma);
        // SAFETY: the piece lies in this queue, which neither moves nor gives these places away until it is sent.
        stream.m0ar().write(|w| unsafe { w.bits(piece.as_ptr() as u32) });
        stream.ndtr().write(|w| w.ndt().set(piece.len() as u16));
        stream.cr().write(|w| {
            w.chsel().set(CHANNEL).dir().memory_to_peripheral();
            w.minc().set_bit().en().set_bit()
        });
    }
}

impl Line for SerialLine {
    fn read(&mut self) -> Option<u8> {
        let left = usize::from(self.dma.st(self.streams.receive & 7).ndtr().read().ndt().bits());
        // The DMA counts down to 0 and reloads; both mean the beginning of the ring.
        let write = (RING - left.min(RING)) % RING;
        if self.read == write {
            return None;
        }
        let byte = RECEIVED[self.read % RING].load(Ordering::Acquire);
        self.read = (self.read + 1) % RING;
        Some(byte)
    }

    fn room(&mut self) -> usize {
        self.pump();
        QUEUE - self.queue.len()
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            let _ = self.queue.push_back(byte);
        }
        self.pump();
    }
}
