//! The merge on its two matrices, move by move, as in the paper's example with m = 6: a yellow
//! arrow points at the target's row, a green frame surrounds the query's votes.
//!
//! Votes are handed on as in preset `paper`: a component that joins takes over those of its target.

use super::canvas::{Anchor, Area, Canvas, Colour, Stroke, between, opaque};
use super::font::{self, Weight};
use super::theme;
use crate::messages::palette::instance_colour;
use divmerge_core::cluster::{Merge, MergeStep, Votes};

/// A move of the merge: a component opens an instance, or joins one.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Move {
    /// The component that asks, or the one that opens the instance.
    target: u32,
    /// The component that joins.
    query: Option<u32>,
    words: String,
}

/// V+ or V-, dense: row after row.
type Matrix = Vec<Vec<u64>>;

const MARGIN: f64 = 16.0;
const CELL: f64 = 19.0;
const GAP: f64 = 22.0;
const MOVES_IN_ROW: usize = 3;
const GREEN: Colour = [0, 150, 90, 255];
const YELLOW: Colour = [240, 180, 0, 255];
const AGAINST: [u8; 3] = [255, 176, 140];
const DIAGONAL: [u8; 3] = [238, 239, 241];
const RULE: Colour = [200, 204, 210, 255];
/// An arrow to the right, its tip a little left of the origin.
const ARROW: [[f64; 2]; 7] = [
    [-3.0, 0.0],
    [-11.0, -5.5],
    [-11.0, -2.2],
    [-20.0, -2.2],
    [-20.0, 2.2],
    [-11.0, 2.2],
    [-11.0, 5.5],
];

/// Draws every move of a merge. Meant for a handful of components.
pub fn merge_moves(votes: &Votes, merge: &Merge) -> Canvas {
    let m = votes.components as usize;
    let mut matrices = matrices(votes);
    let moves = moves(merge);
    let side = CELL * m as f64;
    let [width, height] = [2.0 * side + 74.0, side + 96.0];
    let (rows, columns) = (moves.len().div_ceil(MOVES_IN_ROW).max(1), MOVES_IN_ROW as f64);
    let mut canvas = Canvas::new(
        2.0 * MARGIN + columns * width + (columns - 1.0) * GAP,
        2.0 * MARGIN + rows as f64 * height - GAP,
        theme::PAGE,
    );
    let mut assigned = vec![0_u32; m];
    for (place, step) in moves.iter().enumerate() {
        let x = MARGIN + (place % MOVES_IN_ROW) as f64 * (width + GAP);
        let y = MARGIN + (place / MOVES_IN_ROW) as f64 * height;
        let words = format!("{}.  {}", place + 1, step.words);
        let words = font::fitted(&words, theme::TITLE, Weight::Medium, width);
        canvas.text([x, y + 14.0], words, theme::title());
        for (k, (name, matrix)) in ["V+", "V−"].into_iter().zip(&matrices).enumerate() {
            let corner = [x + 24.0 + k as f64 * (side + 34.0), y + 48.0];
            let tint = [theme::IN_FAVOUR, AGAINST][k];
            Grid { corner, name, tint, matrix }.draw(&mut canvas, step, &assigned);
        }
        let joined = step.query.unwrap_or(step.target) as usize - 1;
        assigned[joined] = merge.instance_of_component[joined];
        if let Some(query) = step.query {
            for matrix in &mut matrices {
                hand_on(matrix, step.target as usize - 1, query as usize - 1, &assigned);
            }
        }
        chips(&mut canvas, [x, y + 62.0 + side], &assigned);
    }
    canvas
}

/// V+ and V- of all pairs.
fn matrices(votes: &Votes) -> [Matrix; 2] {
    let m = votes.components as usize;
    let mut matrices = [vec![vec![0; m]; m], vec![vec![0; m]; m]];
    for vote in &votes.pairs {
        let [a, b] = [vote.a, vote.b].map(|label| label as usize - 1);
        for (matrix, count) in matrices.iter_mut().zip([vote.positive, vote.negative]) {
            matrix[a][b] = u64::from(count);
            matrix[b][a] = u64::from(count);
        }
    }
    matrices
}

/// Openings and joinings in their order.
fn moves(merge: &Merge) -> Vec<Move> {
    let mut moves = Vec::new();
    let mut opened = 0;
    let mut steps = merge.steps.iter().peekable();
    for (label, &instance) in (1_u32..).zip(&merge.instance_of_component) {
        if instance <= opened {
            continue;
        }
        opened = instance;
        let words = format!("{label} opens an instance");
        moves.push(Move { target: label, query: None, words });
        let is_own =
            |step: &&MergeStep| merge.instance_of_component[step.query as usize - 1] == instance;
        while let Some(&MergeStep { target, query, positive, negative }) = steps.next_if(is_own) {
            let words = format!("{target} asks {query}: {positive} > {negative}, joins");
            moves.push(Move { target, query: Some(query), words });
        }
    }
    moves
}

/// The query takes over the target's votes towards all components without an instance.
fn hand_on(matrix: &mut Matrix, target: usize, query: usize, assigned: &[u32]) {
    for other in (0..assigned.len()).filter(|&other| assigned[other] == 0) {
        matrix[query][other] += matrix[target][other];
    }
}

/// One matrix of a move, its upper left cell at the corner.
struct Grid<'a> {
    corner: [f64; 2],
    name: &'a str,
    tint: [u8; 3],
    matrix: &'a Matrix,
}

/// The middle of row or column k.
fn middle(k: usize) -> f64 {
    CELL * (k as f64 + 0.5)
}

impl Grid<'_> {
    fn draw(&self, canvas: &mut Canvas, step: &Move, assigned: &[u32]) {
        self.names(canvas, step.target as usize - 1);
        let most = self.matrix.iter().flatten().copied().max().unwrap_or(0).max(1) as f64;
        for (row, votes) in self.matrix.iter().enumerate() {
            for (column, &count) in votes.iter().enumerate() {
                let is_over = assigned[column] != 0;
                self.cell(canvas, [row, column], count, most, is_over);
            }
        }
        self.marks(canvas, step);
    }

    fn area(&self, [row, column]: [usize; 2]) -> Area {
        let [x, y] = self.corner;
        let (x, y) = (x + CELL * column as f64, y + CELL * row as f64);
        Area { x, y, width: CELL, height: CELL }
    }

    /// The matrix's name and the numbers of rows and columns; the arrow covers that of the target.
    fn names(&self, canvas: &mut Canvas, target: usize) {
        let [x, y] = self.corner;
        let style = theme::text(theme::SMALL, Weight::Medium, theme::INK, Anchor::Middle);
        canvas.text([x - 13.0, y - 5.0], self.name, style);
        for k in 0..self.matrix.len() {
            let words = (k + 1).to_string();
            canvas.text([x + middle(k), y - 5.0], words.clone(), theme::faint(Anchor::Middle));
            if k != target {
                canvas.text([x - 9.0, y + middle(k) + 4.0], words, theme::faint(Anchor::Middle));
            }
        }
    }

    /// A count; pale if its column is asked no more.
    fn cell(&self, canvas: &mut Canvas, place: [usize; 2], count: u64, most: f64, is_over: bool) {
        let area = self.area(place);
        let is_diagonal = place[0] == place[1];
        let part = count as f64 / most * if is_over { 0.25 } else { 1.0 };
        let fill = if is_diagonal { DIAGONAL } else { between([255; 3], self.tint, part) };
        canvas.rect(area, Some(opaque(fill)), Some(Stroke::solid(RULE, 0.7)));
        if !is_diagonal {
            let ink = if is_over || count == 0 { theme::PALE_INK } else { theme::INK };
            let at = [area.x + CELL / 2.0, area.y + CELL / 2.0 + 4.0];
            canvas.text(at, count.to_string(), theme::small(ink, Anchor::Middle));
        }
    }

    /// The arrow at the target's row, and the frame around the query's votes.
    fn marks(&self, canvas: &mut Canvas, step: &Move) {
        let [x, y] = self.corner;
        let target = step.target as usize - 1;
        let arrow = ARROW.map(|[dx, dy]| [x + dx, y + middle(target) + dy]);
        canvas.polygon(arrow.to_vec(), Some(YELLOW), None);
        if let Some(query) = step.query {
            let area = self.area([target, query as usize - 1]);
            canvas.rect(area, None, Some(Stroke::solid(GREEN, 2.2)));
            let [x, y] = [area.x + CELL / 2.0, y - 15.0];
            let tip = vec![[x, y + 1.0], [x - 4.5, y - 7.0], [x + 4.5, y - 7.0]];
            canvas.polygon(tip, Some(GREEN), None);
        }
    }
}

/// The components after the move, coloured by instance.
fn chips(canvas: &mut Canvas, [x, y]: [f64; 2], assigned: &[u32]) {
    for (k, &instance) in assigned.iter().enumerate() {
        let centre = [x + 24.0 + middle(k), y];
        let colour = opaque(instance_colour(instance));
        let (fill, rim, ink) = match instance {
            0 => (theme::PAGE, theme::PALE_INK, theme::FAINT_INK),
            _ => (colour, colour, theme::INK),
        };
        canvas.circle(centre, 7.5, Some(fill), Some(Stroke::solid(rim, 1.0)));
        let style = theme::text(theme::SMALL, Weight::Medium, ink, Anchor::Middle);
        canvas.text([centre[0], y + 4.0], (k + 1).to_string(), style);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use divmerge_core::cluster::{ClusterParams, Vote, merge};

    #[test]
    fn moves_come_in_order_and_votes_are_handed_on() {
        let pairs = [(1, 2, 4, 0), (1, 3, 2, 3), (2, 3, 4, 2)];
        let pairs = pairs.map(|(a, b, positive, negative)| Vote { a, b, positive, negative });
        let votes = Votes { components: 3, pairs: pairs.to_vec() };
        let merge = merge(&votes, &ClusterParams::paper());
        let moves = moves(&merge);
        let queries: Vec<Option<u32>> = moves.iter().map(|step| step.query).collect();
        assert_eq!((moves[0].target, queries), (1, vec![None, Some(2), Some(3)]));
        let mut positive = vec![vec![0, 4, 2], vec![4, 0, 4], vec![2, 4, 0]];
        hand_on(&mut positive, 0, 1, &[1, 1, 0]);
        assert_eq!(positive[1], [4, 0, 6]);
        assert_eq!(merge.steps[1].positive, 6);
        let canvas = merge_moves(&votes, &merge);
        assert!(canvas.width > 100.0 && canvas.height > 100.0);
    }
}
