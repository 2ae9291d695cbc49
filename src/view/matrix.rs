//! The merge on its two matrices, move by move, as in the paper's example with m = 6: a yellow arrow at the
//! target's row, a green frame around the query's votes.
//!
//! Rows are handed on as in preset `paper`: who joins takes over the votes of the row that decided.

use super::canvas::{Anchor, Area, Canvas, Colour, Stroke, between, opaque};
use super::font::{self, Weight};
use super::theme;
use crate::cluster::{Merge, MergeStep, Votes};
use crate::palette::instance_colour;

/// Something that happens in the merge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Move {
    /// A component opens an instance.
    Opens(u32),
    /// A component joins.
    Joins(MergeStep),
}

/// V+ or V-, dense: row after row.
type Matrix = Vec<Vec<u64>>;

const MARGIN: f64 = 16.0;
const CELL: f64 = 19.0;
const FRAMES_IN_ROW: usize = 3;
const GREEN: Colour = [0, 150, 90, 255];
const YELLOW: Colour = [240, 180, 0, 255];

/// Draws every move of a merge. Meant for a handful of components.
pub fn merge_moves(votes: &Votes, merge: &Merge) -> Canvas {
    let m = votes.components as usize;
    let mut matrices = [vec![vec![0; m]; m], vec![vec![0; m]; m]];
    for vote in &votes.pairs {
        let [a, b] = [vote.a, vote.b].map(|label| label as usize - 1);
        for (matrix, count) in matrices.iter_mut().zip([vote.positive, vote.negative]) {
            matrix[a][b] = u64::from(count);
            matrix[b][a] = u64::from(count);
        }
    }
    let moves = moves(merge);
    let side = CELL * m as f64;
    let frame = [2.0 * side + 74.0, side + 96.0];
    let rows = moves.len().div_ceil(FRAMES_IN_ROW).max(1) as f64;
    let columns = FRAMES_IN_ROW as f64;
    let width = 2.0 * MARGIN + columns * frame[0] + (columns - 1.0) * 22.0;
    let mut canvas = Canvas::new(width, 2.0 * MARGIN + rows * frame[1] - 22.0, theme::PAGE);
    let mut assigned = vec![0_u32; m];
    for (number, step) in moves.iter().enumerate() {
        let corner = [
            MARGIN + (number % FRAMES_IN_ROW) as f64 * (frame[0] + 22.0),
            MARGIN + (number / FRAMES_IN_ROW) as f64 * frame[1],
        ];
        let (target, query) = match step {
            Move::Opens(opener) => (*opener, None),
            Move::Joins(step) => (step.target, Some(step.query)),
        };
        draw_move(&mut canvas, corner, number + 1, step, &matrices, &assigned, frame[0]);
        let joined = query.unwrap_or(target) as usize - 1;
        assigned[joined] = merge.instance_of_component[joined];
        if let Some(query) = query {
            for matrix in &mut matrices {
                hand_on(matrix, target as usize - 1, query as usize - 1, &assigned);
            }
        }
        chips(&mut canvas, [corner[0], corner[1] + 62.0 + side], &assigned);
    }
    canvas
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
        moves.push(Move::Opens(label));
        let is_own =
            |step: &&MergeStep| merge.instance_of_component[step.query as usize - 1] == instance;
        while let Some(step) = steps.next_if(is_own) {
            moves.push(Move::Joins(*step));
        }
    }
    moves
}

/// The query takes over the target's votes towards everyone who has no instance yet.
fn hand_on(matrix: &mut Matrix, target: usize, query: usize, assigned: &[u32]) {
    for other in (0..assigned.len()).filter(|&other| assigned[other] == 0) {
        matrix[query][other] += matrix[target][other];
    }
}

fn draw_move(
    canvas: &mut Canvas,
    [x, y]: [f64; 2],
    number: usize,
    step: &Move,
    matrices: &[Matrix; 2],
    assigned: &[u32],
    width: f64,
) {
    let (target, query, words) = match step {
        Move::Opens(opener) => (*opener, None, format!("{opener} opens an instance")),
        Move::Joins(s) => {
            let words =
                format!("{} asks {}: {} > {}, joins", s.target, s.query, s.positive, s.negative);
            (s.target, Some(s.query), words)
        }
    };
    let style = theme::text(theme::TITLE, Weight::Medium, theme::INK, Anchor::Start);
    let words = font::fitted(&format!("{number}.  {words}"), theme::TITLE, Weight::Medium, width);
    canvas.text([x, y + 14.0], words, style);
    let side = CELL * assigned.len() as f64;
    for (place, (name, matrix)) in ["V+", "V−"].into_iter().zip(matrices).enumerate() {
        let corner = [x + 24.0 + place as f64 * (side + 34.0), y + 48.0];
        grid(canvas, corner, name, matrix, target, query, assigned);
    }
}

fn grid(
    canvas: &mut Canvas,
    [x, y]: [f64; 2],
    name: &str,
    matrix: &Matrix,
    target: u32,
    query: Option<u32>,
    assigned: &[u32],
) {
    let small = |colour| theme::text(theme::SMALL, Weight::Regular, colour, Anchor::Middle);
    let m = matrix.len();
    let most = matrix.iter().flatten().copied().max().unwrap_or(0).max(1) as f64;
    let tint = if name == "V+" { [120, 184, 240] } else { [255, 176, 140] };
    let middle = |k: usize| CELL * (k as f64 + 0.5);
    let style = theme::text(theme::SMALL, Weight::Medium, theme::INK, Anchor::Middle);
    canvas.text([x - 13.0, y - 5.0], name, style);
    for k in 0..m {
        let words = (k + 1).to_string();
        canvas.text([x + middle(k), y - 5.0], words.clone(), small(theme::FAINT_INK));
        if k as u32 + 1 != target {
            canvas.text([x - 9.0, y + middle(k) + 4.0], words, small(theme::FAINT_INK));
        }
    }
    for (row, votes) in matrix.iter().enumerate() {
        for (column, &count) in votes.iter().enumerate() {
            let cell = Area {
                x: x + CELL * column as f64,
                y: y + CELL * row as f64,
                width: CELL,
                height: CELL,
            };
            // What is asked no more is pale.
            let is_over = assigned[column] != 0 || row == column;
            let part = count as f64 / most * if is_over { 0.25 } else { 1.0 };
            let fill = if row == column { [238, 239, 241] } else { between([255; 3], tint, part) };
            let line = Stroke::solid([200, 204, 210, 255], 0.7);
            canvas.rect(cell, Some(opaque(fill)), Some(line));
            if row != column {
                let ink = if is_over || count == 0 { [176, 180, 188, 255] } else { theme::INK };
                let at = [cell.x + CELL / 2.0, cell.y + CELL / 2.0 + 4.0];
                canvas.text(at, count.to_string(), small(ink));
            }
        }
    }
    // The yellow arrow points at the target's row, the green frame is around the query's votes.
    let at = y + middle(target as usize - 1);
    let arrow = [
        [-3.0, 0.0],
        [-11.0, -5.5],
        [-11.0, -2.2],
        [-20.0, -2.2],
        [-20.0, 2.2],
        [-11.0, 2.2],
        [-11.0, 5.5],
    ];
    let arrow = arrow.map(|[dx, dy]| [x + dx, at + dy]);
    canvas.polygon(arrow.to_vec(), Some(YELLOW), None);
    if let Some(query) = query {
        let cell = Area {
            x: x + CELL * (query - 1) as f64,
            y: at - CELL / 2.0,
            width: CELL,
            height: CELL,
        };
        canvas.rect(cell, None, Some(Stroke::solid(GREEN, 2.2)));
        let [tip_x, tip_y] = [cell.x + CELL / 2.0, y - 15.0];
        let marker = [[tip_x, tip_y + 1.0], [tip_x - 4.5, tip_y - 7.0], [tip_x + 4.5, tip_y - 7.0]];
        canvas.polygon(marker.to_vec(), Some(GREEN), None);
    }
}

/// The components after the move, coloured by instance.
fn chips(canvas: &mut Canvas, [x, y]: [f64; 2], assigned: &[u32]) {
    for (k, &instance) in assigned.iter().enumerate() {
        let centre = [x + 24.0 + CELL * (k as f64 + 0.5), y];
        let (fill, rim, ink) = match instance {
            0 => (theme::PAGE, [176, 180, 188, 255], theme::FAINT_INK),
            _ => (opaque(instance_colour(instance)), opaque(instance_colour(instance)), theme::INK),
        };
        canvas.circle(centre, 7.5, Some(fill), Some(Stroke::solid(rim, 1.0)));
        let style = theme::text(theme::SMALL, Weight::Medium, ink, Anchor::Middle);
        canvas.text([centre[0], y + 4.0], (k + 1).to_string(), style);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::{ClusterParams, Vote, merge};

    #[test]
    fn moves_come_in_order_and_votes_are_handed_on() {
        let pairs = [(1, 2, 4, 0), (1, 3, 2, 3), (2, 3, 4, 2)];
        let pairs = pairs.map(|(a, b, positive, negative)| Vote { a, b, positive, negative });
        let votes = Votes { components: 3, pairs: pairs.to_vec() };
        let merge = merge(&votes, &ClusterParams::paper());
        let moves = moves(&merge);
        assert!(matches!(moves[..], [Move::Opens(1), Move::Joins(_), Move::Joins(_)]));
        let mut positive = vec![vec![0, 4, 2], vec![4, 0, 4], vec![2, 4, 0]];
        hand_on(&mut positive, 0, 1, &[1, 1, 0]);
        assert_eq!(positive[1], [4, 0, 6]);
        assert_eq!(merge.steps[1].positive, 6);
        let canvas = merge_moves(&votes, &merge);
        assert!(canvas.width > 100.0 && canvas.height > 100.0);
    }
}
