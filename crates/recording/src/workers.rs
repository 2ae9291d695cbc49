//! Threads that do jobs, and tickets for their results.

use std::num::NonZero;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::mpsc::{Receiver, Sender, SyncSender, TryRecvError, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

type Job = Box<dyn FnOnce() + Send>;

/// Threads that take jobs in the order in which they are given. One thread is the caller's own: a
/// job is done before [`Workers::run`] returns.
///
/// A clone gives jobs to the same threads. Dropping the last clone waits until its jobs are done
/// and the threads have ended.
#[derive(Clone)]
pub struct Workers {
    pool: Option<Arc<Pool>>,
    threads: usize,
}

struct Pool {
    /// `None` once the pool ends.
    jobs: Option<Sender<Job>>,
    threads: Vec<JoinHandle<()>>,
}

impl Workers {
    /// Starts this many threads; none for 0 and 1.
    pub fn start(threads: usize) -> Self {
        if threads <= 1 {
            return Workers { pool: None, threads: 1 };
        }
        let (jobs, queue) = channel::<Job>();
        let queue = Arc::new(Mutex::new(queue));
        let start = |_| {
            let queue = Arc::clone(&queue);
            thread::spawn(move || work(&queue))
        };
        let pool = Pool { threads: (0..threads).map(start).collect(), jobs: Some(jobs) };
        Workers { pool: Some(Arc::new(pool)), threads }
    }

    /// No threads: jobs are done by the caller.
    pub fn none() -> Self {
        Workers::start(1)
    }

    /// The number of cores that this process may use; 1 where that is unknown.
    pub fn per_core() -> usize {
        thread::available_parallelism().map_or(1, NonZero::get)
    }

    /// Threads that do jobs, at least 1.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Whether jobs are done beside the caller's thread.
    pub fn is_parallel(&self) -> bool {
        self.pool.is_some()
    }

    /// Gives a job without a ticket. A panic in it is lost, except for its message.
    pub fn detach(&self, job: impl FnOnce() + Send + 'static) {
        match self.pool.as_ref().and_then(|pool| pool.jobs.as_ref()) {
            None => job(),
            Some(jobs) => {
                let job = move || drop(catch_unwind(AssertUnwindSafe(job)));
                jobs.send(Box::new(job)).expect("threads that live as long as the pool");
            }
        }
    }

    /// Gives a job and returns the ticket for its result. Dropping the ticket gives up the result,
    /// and the job if no thread has begun it.
    pub fn run<R: Send + 'static>(&self, job: impl FnOnce() -> R + Send + 'static) -> Ticket<R> {
        let Some(jobs) = self.pool.as_ref().and_then(|pool| pool.jobs.as_ref()) else {
            return Ticket(Progress::Done(job()));
        };
        let (sender, result) = sync_channel(1);
        let wanted = Arc::new(());
        let is_wanted = Arc::downgrade(&wanted);
        let job = move || {
            if is_wanted.strong_count() > 0 {
                let _ = sender.send(catch_unwind(AssertUnwindSafe(job)));
            }
        };
        jobs.send(Box::new(job)).expect("threads that live as long as the pool");
        Ticket(Progress::Waiting(result, wanted))
    }
}

fn work(queue: &Mutex<Receiver<Job>>) {
    loop {
        // The lock is released before the job begins.
        let job = queue.lock().unwrap_or_else(PoisonError::into_inner).recv();
        match job {
            Ok(job) => job(),
            Err(_) => return,
        }
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.jobs = None;
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

/// Stands for the result of a job.
pub struct Ticket<R>(Progress<R>);

enum Progress<R> {
    Done(R),
    /// Comes from a thread. The second part tells the thread whether the ticket is still held.
    Waiting(Receiver<thread::Result<R>>, #[expect(dead_code)] Arc<()>),
}

/// Gives a result to the holder of a ticket.
pub struct Promise<R>(SyncSender<thread::Result<R>>);

impl<R> Promise<R> {
    /// A promise, and the ticket for its result.
    pub fn new() -> (Self, Ticket<R>) {
        let (sender, result) = sync_channel(1);
        (Promise(sender), Ticket(Progress::Waiting(result, Arc::new(()))))
    }

    /// Gives the result.
    pub fn keep(self, result: R) {
        let _ = self.0.send(Ok(result));
    }
}

impl<R> Ticket<R> {
    /// Whether [`Ticket::wait`] would return at once.
    pub fn is_ready(&mut self) -> bool {
        if let Progress::Waiting(result, _) = &self.0 {
            match result.try_recv() {
                Ok(result) => self.0 = Progress::Done(unwrap(result)),
                Err(TryRecvError::Empty) => return false,
                Err(TryRecvError::Disconnected) => {}
            }
        }
        true
    }

    /// Waits until [`Ticket::wait`] would return at once.
    ///
    /// # Panics
    /// If the job panicked.
    pub fn get_ready(&mut self) {
        if let Progress::Waiting(result, _) = &self.0 {
            self.0 = Progress::Done(unwrap(result.recv().expect("a job that was done")));
        }
    }

    /// Waits for the result.
    ///
    /// # Panics
    /// If the job panicked.
    pub fn wait(self) -> R {
        match self.0 {
            Progress::Done(result) => result,
            Progress::Waiting(result, _) => unwrap(result.recv().expect("a job that was done")),
        }
    }
}

fn unwrap<R>(result: thread::Result<R>) -> R {
    result.unwrap_or_else(|panic| resume_unwind(panic))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn results_belong_to_their_tickets() {
        for threads in [0, 1, 2, 7] {
            let workers = Workers::start(threads);
            let tickets: VecDeque<_> = (0..100).map(|i| workers.run(move || i * i)).collect();
            let results: Vec<i32> = tickets.into_iter().map(Ticket::wait).collect();
            assert_eq!(results, (0..100).map(|i| i * i).collect::<Vec<_>>());
        }
    }

    #[test]
    fn one_thread_is_the_caller_s() {
        let here = thread::current().id();
        assert_eq!(Workers::none().run(|| thread::current().id()).wait(), here);
        assert_ne!(Workers::start(2).run(|| thread::current().id()).wait(), here);
    }

    #[test]
    fn a_ready_ticket_is_ready_and_keeps_its_result() {
        let workers = Workers::start(2);
        let (go, wait) = channel::<()>();
        let mut ticket = workers.run(move || wait.recv().map_or(0, |()| 5));
        assert!(!ticket.is_ready());
        go.send(()).unwrap();
        while !ticket.is_ready() {
            thread::yield_now();
        }
        assert!(ticket.is_ready());
        assert_eq!(ticket.wait(), 5);
    }

    #[test]
    fn a_job_that_panics_panics_where_it_is_waited_for() {
        let workers = Workers::start(2);
        let ticket = workers.run(|| panic!("as asked"));
        let panic = catch_unwind(AssertUnwindSafe(|| ticket.wait())).unwrap_err();
        assert_eq!(panic.downcast_ref::<&str>(), Some(&"as asked"));
        assert_eq!(workers.run(|| 1).wait(), 1, "the thread lives on");
    }

    #[test]
    fn a_promise_is_kept_or_missed() {
        let (promise, mut ticket) = Promise::new();
        assert!(!ticket.is_ready());
        promise.keep(3);
        assert!(ticket.is_ready());
        assert_eq!(ticket.wait(), 3);
        let (promise, ticket) = Promise::<i32>::new();
        drop(promise);
        assert!(catch_unwind(AssertUnwindSafe(|| ticket.wait())).is_err());
    }

    #[test]
    fn what_nobody_waits_for_is_not_begun() {
        let workers = Workers::start(2);
        let stops: Vec<_> = (0..2)
            .map(|_| {
                let (go, wait) = channel::<()>();
                (go, workers.run(move || wait.recv()))
            })
            .collect();
        let done = Arc::new(AtomicUsize::new(0));
        for _ in 0..10 {
            let done = Arc::clone(&done);
            drop(workers.run(move || done.fetch_add(1, Ordering::SeqCst)));
        }
        drop(stops);
        drop(workers);
        assert_eq!(done.load(Ordering::SeqCst), 0);
    }
}
