//! Requests to stop: the signals that batch queues send before they kill a job.
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGUSR2, SIGXCPU};

/// Exit code of a run that wrote a checkpoint on request.
pub const STOPPED: u8 = 3;

/// Set once one of the signals has arrived.
#[derive(Clone, Debug)]
pub struct StopRequest(Arc<AtomicBool>);

/// The one of this process.
static LISTENING: Mutex<Option<StopRequest>> = Mutex::new(None);

impl StopRequest {
    /// Not collective. Listens from now on for SIGTERM, SIGUSR1, SIGUSR2, SIGXCPU (the limit on processor
    /// time is near), SIGHUP (the terminal has gone; not under `nohup`) and SIGINT, a second of which ends
    /// the process at once. To be called as soon as the program starts: until then these signals end it.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn listen() -> std::io::Result<Self> {
        let mut listening = LISTENING.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(request) = &*listening {
            return Ok(request.clone());
        }
        let flag = Arc::new(AtomicBool::new(false));
        signal_hook::flag::register_conditional_shutdown(SIGINT, 130, Arc::clone(&flag))?;
        for signal in [SIGTERM, SIGUSR1, SIGUSR2, SIGXCPU, SIGHUP, SIGINT] {
            if signal != SIGHUP || !is_ignored(signal) {
                signal_hook::flag::register(signal, Arc::clone(&flag))?;
            }
        }
        Ok(listening.insert(Self(flag)).clone())
    }

    /// Whether this rank has received a request to stop.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Whether the parent process has set the signal to be ignored, as `nohup` does with SIGHUP.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|digits| u64::from_str_radix(digits.trim(), 16).ok()).unwrap_or(0);
    mask >> (signal - 1) & 1 == 1
}
