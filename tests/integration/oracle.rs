//! A literal, slow transcription of ALGORITHM sections 1 to 5, preset `paper`, for organised
//! clouds: full m x m matrices, std queues, no shared code with the library.

use std::collections::{HashMap, VecDeque};

/// H x W points in metres, row by row; `None` where a pixel is empty or masked out.
pub struct Image {
    pub rows: usize,
    pub columns: usize,
    pub points: Vec<Option<[f64; 3]>>,
}

pub struct Parameters {
    pub voxel: f64,
    pub theta: f64,
    pub gap_rows: usize,
    pub gap_columns: usize,
}

/// Label image after the divide step and after the merge step; 0 without a label.
pub struct Labels {
    pub component: Vec<usize>,
    pub instance: Vec<usize>,
    pub positive: Vec<Vec<u64>>,
    pub negative: Vec<Vec<u64>>,
}

pub fn divide_and_merge(image: &Image, parameters: &Parameters) -> Labels {
    let seeds = seeds(image, parameters);
    let (component, positive, negative) = local_clustering(image, &seeds, parameters);
    let merged = voting_and_merging(positive.clone(), negative.clone());
    let instance =
        component.iter().map(|&label| if label > 0 { merged[label - 1] } else { 0 }).collect();
    Labels { component, instance, positive, negative }
}

fn condition(a: [f64; 3], b: [f64; 3], theta: f64) -> bool {
    let dot = |u: [f64; 3], v: [f64; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    let (p, q) = if dot(a, a) >= dot(b, b) { (a, b) } else { (b, a) };
    let cross = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    dot(cross, cross).sqrt() > theta.tan() * (dot(p, p) - dot(p, q))
}

fn seeds(image: &Image, parameters: &Parameters) -> Vec<(usize, usize)> {
    let mut first: HashMap<[i64; 3], ()> = HashMap::new();
    let mut seeds = Vec::new();
    for r in 0..image.rows {
        for c in 0..image.columns {
            let Some(point) = image.points[r * image.columns + c] else {
                continue;
            };
            let voxel = point.map(|x| (x / parameters.voxel).floor() as i64);
            if first.insert(voxel, ()).is_none() {
                seeds.push((r, c));
            }
        }
    }
    seeds
}

/// left, right, up, down
fn neighborhood(image: &Image, at: (usize, usize), p: &Parameters) -> Vec<(usize, usize)> {
    let (rows, columns) = (image.rows as i64, image.columns as i64);
    let mut found = Vec::new();
    for (dr, dc, gap) in
        [(0, -1, p.gap_columns), (0, 1, p.gap_columns), (-1, 0, p.gap_rows), (1, 0, p.gap_rows)]
    {
        for step in 1..=gap as i64 {
            let r = at.0 as i64 + dr * step;
            let c = (at.1 as i64 + dc * step).rem_euclid(columns);
            if r < 0 || r >= rows {
                break;
            }
            let (r, c) = (r as usize, c as usize);
            if (r, c) == at {
                break; // all the way round
            }
            if image.points[r * image.columns + c].is_some() {
                found.push((r, c));
                break;
            }
        }
    }
    found
}

type Matrix = Vec<Vec<u64>>;

fn local_clustering(
    image: &Image,
    seeds: &[(usize, usize)],
    parameters: &Parameters,
) -> (Vec<usize>, Matrix, Matrix) {
    let m = seeds.len();
    let at = |(r, c): (usize, usize)| r * image.columns + c;
    let mut labels = vec![0; image.points.len()];
    let mut v_plus = vec![vec![0; m]; m];
    let mut v_minus = vec![vec![0; m]; m];
    let mut undecided = Vec::new();
    let mut queues: Vec<VecDeque<(usize, usize)>> = Vec::new();
    for (i, &seed) in seeds.iter().enumerate() {
        queues.push(VecDeque::from([seed]));
        labels[at(seed)] = i + 1;
    }
    while queues.iter().any(|queue| !queue.is_empty()) {
        for queue in &mut queues {
            let Some(p) = queue.pop_front() else { continue };
            for n in neighborhood(image, p, parameters) {
                let (Some(a), Some(b)) = (image.points[at(p)], image.points[at(n)]) else {
                    unreachable!()
                };
                let (own, other) = (labels[at(p)], labels[at(n)]);
                match (condition(a, b, parameters.theta), other > 0) {
                    (true, false) => {
                        labels[at(n)] = own;
                        queue.push_back(n);
                    }
                    (true, true) => {
                        v_plus[own - 1][other - 1] += 1;
                        v_plus[other - 1][own - 1] += 1;
                    }
                    (false, true) => {
                        v_minus[own - 1][other - 1] += 1;
                        v_minus[other - 1][own - 1] += 1;
                    }
                    (false, false) => undecided.push((p, n)),
                }
            }
        }
    }
    for (p, n) in undecided {
        let (own, other) = (labels[at(p)], labels[at(n)]);
        if other > 0 {
            v_minus[own - 1][other - 1] += 1;
            v_minus[other - 1][own - 1] += 1;
        }
    }
    (labels, v_plus, v_minus)
}

fn voting_and_merging(mut v_plus: Matrix, mut v_minus: Matrix) -> Vec<usize> {
    let m = v_plus.len();
    let mut merged = vec![0; m];
    let mut current = 0;
    for first in 0..m {
        if merged[first] != 0 {
            continue;
        }
        current += 1;
        merged[first] = current;
        let mut queue = VecDeque::from([first]);
        while let Some(target) = queue.pop_front() {
            for query in 0..m {
                if merged[query] != 0 || v_plus[target][query] <= v_minus[target][query] {
                    continue;
                }
                merged[query] = current;
                queue.push_back(query);
                for i in 0..m {
                    v_plus[query][i] += v_plus[target][i];
                    v_minus[query][i] += v_minus[target][i];
                }
            }
        }
    }
    merged
}
