//! Sends under way, with the buffers they read from.
//!
//! A small owning wrapper around `MPI_Isend` and `MPI_Issend`. The wrapper of the `mpi` crate
//! borrows its buffer for a scope, which cannot be stored beside that buffer in one value.

use std::os::raw::c_void;

use bytemuck::Pod;
use mpi::ffi;
use mpi::traits::{AsRaw, Equivalence};

use super::super::Comm;
use super::Mode;

/// A message on its way: owns the buffer until MPI has finished reading it.
pub(in super::super) struct Outgoing<T: Pod> {
    requests: Vec<ffi::MPI_Request>,
    /// Only kept alive; nothing touches it while requests are open.
    _buffer: Vec<T>,
}

impl<T: Pod> Outgoing<T> {
    /// Not collective. Starts to send `buffer` to rank `to`.
    ///
    /// Sent in pieces of [`Comm::piece_len`] items; the last piece is shorter than that (maybe
    /// empty), from which the receiver sees that the message is complete.
    pub(in super::super) fn start(comm: &Comm, to: usize, tag: i32, mode: Mode, buffer: Vec<T>) -> Self {
        assert!(to < comm.size(), "no rank {to} among {}", comm.size());
        let limit = comm.piece_len::<T>();
        let pieces = buffer.len() / limit + 1;
        let mut requests = Vec::with_capacity(pieces);
        for piece in 0..pieces {
            let items = &buffer[piece * limit..buffer.len().min((piece + 1) * limit)];
            let bytes: &[u8] = bytemuck::cast_slice(items);
            let send = match mode {
                Mode::Standard => ffi::MPI_Isend,
                Mode::Synchronous => ffi::MPI_Issend,
            };
            // SAFETY: `bytes` lies in the heap block of `buffer`, which moves into `_buffer` below.
            // That block neither moves nor changes until `drop` has waited for all requests (and
            // if the value is leaked, so is the block). The count fits in 31 bits by `piece_len`.
            let request = unsafe {
                let mut request = ffi::RSMPI_REQUEST_NULL;
                send(
                    bytes.as_ptr() as *const c_void,
                    bytes.len() as i32,
                    u8::equivalent_datatype().as_raw(),
                    to as i32,
                    tag,
                    comm.all().communicator().as_raw(),
                    &mut request,
                );
                request
            };
            requests.push(request);
        }
        Outgoing { requests, _buffer: buffer }
    }

    /// Not collective. Whether the send has completed; lets MPI make progress.
    pub(in super::super) fn test(&mut self) -> bool {
        let mut done = 0;
        // SAFETY: the requests are ours; completed ones are set to the null request by MPI.
        unsafe {
            ffi::MPI_Testall(
                self.requests.len() as i32,
                self.requests.as_mut_ptr(),
                &mut done,
                ffi::RSMPI_STATUSES_IGNORE,
            );
        }
        done != 0
    }
}

impl<T: Pod> Drop for Outgoing<T> {
    /// Waits until the buffer is free.
    fn drop(&mut self) {
        if std::thread::panicking() {
            // The receiver may never come. Leaking the block keeps the open sends valid.
            std::mem::forget(std::mem::take(&mut self._buffer));
            return;
        }
        // SAFETY: the requests are ours, and the buffer is dropped after this call.
        unsafe {
            ffi::MPI_Waitall(
                self.requests.len() as i32,
                self.requests.as_mut_ptr(),
                ffi::RSMPI_STATUSES_IGNORE,
            );
        }
    }
}
