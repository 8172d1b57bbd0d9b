//! Work for all rows of a stage, spread over threads.
//!
//! What is computed for a row depends on that row and on inputs that the stage does not change, and
//! results are in the order of the rows: the number of threads changes no bit.

use std::{
    ops::Range,
    sync::{Arc, OnceLock},
};

use rayon::{ThreadPool, ThreadPoolBuilder, prelude::*};

/// Least number of agents for which other threads are used: below it, waking them takes longer than
/// they save.
const AGENTS_MIN: usize = 192;
/// Least number of rows that a thread takes at once.
const ROWS_AT_ONCE: usize = 32;
/// Largest number of threads: what stays in order would bound the gain of more.
const THREADS_MAX: usize = 8;

/// The threads of a planner, which start with the first frame that needs them.
#[derive(Clone)]
pub(crate) struct Threads {
    count: usize,
    pool: Arc<OnceLock<Option<ThreadPool>>>,
}

impl Threads {
    /// Returns `count` threads, or with 0 one per core that this process may use, up to
    /// [`THREADS_MAX`].
    pub(crate) fn new(count: usize) -> Threads {
        let available = || std::thread::available_parallelism().map_or(1, usize::from);
        let count = if count == 0 { available().min(THREADS_MAX) } else { count };
        Threads { count, pool: Arc::default() }
    }

    /// Plans a frame with this number of agents.
    pub(crate) fn run<R: Send>(&self, agents: usize, work: impl FnOnce(Spread) -> R + Send) -> R {
        if self.count < 2 || agents < AGENTS_MIN {
            return work(Spread::Alone);
        }
        match self.pool.get_or_init(|| self.start()) {
            Some(pool) => pool.install(|| work(Spread::Pool)),
            None => work(Spread::Alone),
        }
    }

    fn start(&self) -> Option<ThreadPool> {
        let pool = ThreadPoolBuilder::new()
            .num_threads(self.count)
            .thread_name(|index| format!("traffic-{index}"))
            .build();
        pool.inspect_err(|why| {
            log::warn!("{} planning threads did not start, one plans all: {why}", self.count);
        })
        .ok()
    }
}

/// Where the rows of a stage are computed.
#[derive(Clone, Copy)]
pub(crate) enum Spread {
    /// In the calling thread.
    Alone,
    /// In all threads of the pool that the calling thread belongs to.
    Pool,
}

impl Spread {
    /// Changes every row and what is kept beside it.
    pub(crate) fn update_pairs<T: Send, B: Send>(
        self,
        rows: &mut [T],
        beside: &mut [B],
        work: impl Fn(usize, &mut T, &mut B) + Sync,
    ) {
        match self {
            Spread::Alone => {
                let rows = rows.iter_mut().zip(beside).enumerate();
                rows.for_each(|(row, (of, beside))| work(row, of, beside));
            }
            Spread::Pool => {
                let rows = rows.par_iter_mut().zip(beside).with_min_len(ROWS_AT_ONCE).enumerate();
                rows.for_each(|(row, (of, beside))| work(row, of, beside));
            }
        }
    }

    /// Changes every row, and replaces `results` by one result for each.
    pub(crate) fn update_into<T: Send, R: Send>(
        self,
        rows: &mut [T],
        results: &mut Vec<R>,
        work: impl Fn(usize, &mut T) -> R + Sync,
    ) {
        match self {
            Spread::Alone => {
                results.clear();
                results.extend(rows.iter_mut().enumerate().map(|(row, of)| work(row, of)));
            }
            Spread::Pool => {
                let rows = rows.par_iter_mut().with_min_len(ROWS_AT_ONCE).enumerate();
                rows.map(|(row, of)| work(row, of)).collect_into_vec(results);
            }
        }
    }

    /// Replaces `results` by one result for each of `count` rows.
    pub(crate) fn map_into<R: Send>(
        self,
        count: usize,
        results: &mut Vec<R>,
        work: impl Fn(usize) -> R + Sync,
    ) {
        match self {
            Spread::Alone => {
                results.clear();
                results.extend((0..count).map(work));
            }
            Spread::Pool => {
                let rows = (0..count).into_par_iter().with_min_len(ROWS_AT_ONCE);
                rows.map(&work).collect_into_vec(results);
            }
        }
    }

    /// As [`Spread::map_into`] for two results of each row.
    pub(crate) fn map_into_pair<A: Send, B: Send>(
        self,
        count: usize,
        (first, second): (&mut Vec<A>, &mut Vec<B>),
        work: impl Fn(usize) -> (A, B) + Sync,
    ) {
        match self {
            Spread::Alone => {
                first.clear();
                second.clear();
                for (a, b) in (0..count).map(work) {
                    first.push(a);
                    second.push(b);
                }
            }
            Spread::Pool => {
                let rows = (0..count).into_par_iter().with_min_len(ROWS_AT_ONCE);
                rows.map(&work).unzip_into_vecs(first, second);
            }
        }
    }

    /// Replaces `items` by what `work` appends for each of `count` rows.
    pub(crate) fn list<R: Send>(
        self,
        count: usize,
        items: &mut Vec<R>,
        work: impl Fn(usize, &mut Vec<R>) + Sync,
    ) {
        let expected = items.len();
        items.clear();
        match self {
            Spread::Alone => (0..count).for_each(|row| work(row, items)),
            Spread::Pool => {
                let lists: Vec<Vec<R>> = map_ranges(count, |rows| {
                    let mut list = part(expected, rows.len(), count);
                    rows.for_each(|row| work(row, &mut list));
                    list
                });
                lists.into_iter().for_each(|list| items.extend(list));
            }
        }
    }

    /// Changes every row, and replaces `items` by what `work` appends for each.
    pub(crate) fn update_list<T: Send, R: Send>(
        self,
        rows: &mut [T],
        items: &mut Vec<R>,
        work: impl Fn(usize, &mut T, &mut Vec<R>) + Sync,
    ) {
        let (expected, count) = (items.len(), rows.len());
        items.clear();
        match self {
            Spread::Alone => {
                rows.iter_mut().enumerate().for_each(|(row, of)| work(row, of, items));
            }
            Spread::Pool => {
                let at_once = rows_at_once(count);
                let ranges = rows.par_chunks_mut(at_once).enumerate();
                let lists: Vec<Vec<R>> = ranges
                    .map(|(range, rows)| {
                        let mut list = part(expected, rows.len(), count);
                        let rows = (range * at_once..).zip(rows);
                        rows.for_each(|(row, of)| work(row, of, &mut list));
                        list
                    })
                    .collect();
                lists.into_iter().for_each(|list| items.extend(list));
            }
        }
    }

    /// Changes every group of consecutive items that belong together.
    pub(crate) fn groups<T: Send>(
        self,
        items: &mut [T],
        together: impl Fn(&T, &T) -> bool + Sync + Send,
        work: impl Fn(&mut [T]) + Sync + Send,
    ) {
        match self {
            Spread::Alone => items.chunk_by_mut(together).for_each(work),
            Spread::Pool => items.par_chunk_by_mut(together).for_each(work),
        }
    }

    /// Sorts items by a key that is different for each.
    pub(crate) fn sort<T: Send, K: Ord>(self, items: &mut [T], key: impl Fn(&T) -> K + Sync) {
        match self {
            Spread::Alone => items.sort_unstable_by_key(key),
            Spread::Pool => items.par_sort_unstable_by_key(key),
        }
    }

    /// As [`Spread::list`]; `first` becomes the index of the first item of each row, and the number
    /// of items.
    pub(crate) fn ragged<R: Send>(
        self,
        count: usize,
        (items, first): (&mut Vec<R>, &mut Vec<u32>),
        work: impl Fn(usize, &mut Vec<R>) + Sync,
    ) {
        let expected = items.len();
        items.clear();
        first.clear();
        match self {
            Spread::Alone => {
                for row in 0..count {
                    first.push(items.len() as u32);
                    work(row, items);
                }
            }
            Spread::Pool => {
                let lists: Vec<(Vec<R>, Vec<u32>)> = map_ranges(count, |rows| {
                    let mut list = part(expected, rows.len(), count);
                    let mut first = Vec::with_capacity(rows.len());
                    for row in rows {
                        first.push(list.len() as u32);
                        work(row, &mut list);
                    }
                    (list, first)
                });
                for (list, own) in lists {
                    let before = items.len() as u32;
                    first.extend(own.into_iter().map(|begin| before + begin));
                    items.extend(list);
                }
            }
        }
        first.push(items.len() as u32);
    }
}

/// Returns a result for each of the ranges of rows that a thread takes at once, in order.
fn map_ranges<R: Send>(count: usize, work: impl Fn(Range<usize>) -> R + Sync) -> Vec<R> {
    let at_once = rows_at_once(count);
    let ranges = (0..count.div_ceil(at_once)).into_par_iter();
    ranges.map(|range| work(range * at_once..((range + 1) * at_once).min(count))).collect()
}

/// Returns a list for the items of some of `count` rows, where about as many are expected for all rows as
/// in the frame before: with room for twice the mean, so that it seldom grows.
fn part<R>(expected: usize, rows: usize, count: usize) -> Vec<R> {
    Vec::with_capacity(2 * expected * rows / count.max(1))
}

/// Returns the number of rows of such a range.
fn rows_at_once(count: usize) -> usize {
    (count / 64).clamp(ROWS_AT_ONCE, 256)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_threads_gives_the_same_lists() {
        let of = |count: usize, rows: usize| {
            Threads::new(count).run(AGENTS_MIN, |spread| {
                let mut state: Vec<usize> = (0..rows).collect();
                let mut beside = vec![1; rows];
                spread
                    .update_pairs(&mut state, &mut beside, |row, of, beside| *of += row * *beside);
                let (mut results, mut items, mut first) = (Vec::new(), Vec::new(), Vec::new());
                spread.update_into(&mut state, &mut results, |row, of| {
                    *of *= 3;
                    *of + row
                });
                let mut changed = Vec::new();
                spread.update_list(&mut state, &mut changed, |row, of, changed| {
                    *of += 1;
                    changed.extend((*of % 5 == 0).then_some(row));
                });
                assert_eq!(changed.len(), rows / 5);
                spread.sort(&mut changed, |row| std::cmp::Reverse(*row));
                spread.groups(&mut changed, |a, b| a / 8 == b / 8, <[usize]>::reverse);
                let append = |row: usize, to: &mut Vec<usize>| to.extend(0..state[row] % 5);
                spread.ragged(rows, (&mut items, &mut first), append);
                let (mut list, mut pair) = (Vec::new(), (Vec::new(), Vec::new()));
                spread.list(rows, &mut list, append);
                spread.map_into_pair(rows, (&mut pair.0, &mut pair.1), |row| (row, state[row]));
                assert_eq!(list, items);
                assert_eq!(first.len(), rows + 1);
                (results, changed, items, first, pair)
            })
        };
        for rows in [0, 1, 31, 32, 33, 1000] {
            let alone = of(1, rows);
            assert_eq!(alone, of(2, rows));
            assert_eq!(alone, of(5, rows));
        }
    }
}
