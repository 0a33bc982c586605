//! Least squares over links against dense elimination, and what they keep.

use super::super::tests::{linked, random};
use super::*;
use crate::lattice::Extent;

/// One channel by Gaussian elimination.
fn dense(primal: &Image, graph: &Graph, weights: &[f32], channel: usize, alpha: f64) -> Vec<f64> {
    let n = primal.extent().pixels();
    let mut rows = vec![vec![0.0; n + 1]; n];
    for (i, p) in primal.plane(channel).iter().enumerate() {
        rows[i][i] = alpha * alpha;
        rows[i][n] = alpha * alpha * f64::from(*p);
    }
    for (([i, j], difference), weight) in graph.links.iter().zip(&graph.differences).zip(weights) {
        let (i, j, weight, difference) = (*i as usize, *j as usize, f64::from(*weight), f64::from(difference[channel]));
        for (from, to, sign) in [(i, j, -1.0), (j, i, 1.0)] {
            rows[from][from] += weight;
            rows[from][to] -= weight;
            rows[from][n] += sign * weight * difference;
        }
    }
    // Positive definite, so no pivoting.
    for k in 0..n {
        for i in k + 1..n {
            let factor = rows[i][k] / rows[k][k];
            for j in k..=n {
                rows[i][j] -= factor * rows[k][j];
            }
        }
    }
    let mut solution = vec![0.0; n];
    for k in (0..n).rev() {
        let rest: f64 = (k + 1..n).map(|j| rows[k][j] * solution[j]).sum();
        solution[k] = (rows[k][n] - rest) / rows[k][k];
    }
    solution
}

fn measurements<'m>(primal: &'m Image, graph: Option<&'m Graph>) -> Measurements<'m> {
    Measurements { graph, ..Measurements::new(primal, primal, primal) }
}

#[test]
fn least_squares_agree_with_dense_elimination() {
    for (width, height) in [(1, 1), (1, 7), (11, 1), (7, 5), (8, 8), (13, 11)] {
        let extent = Extent { width, height };
        let (primal, graph) = (random(extent, 1, 2.0), linked(extent, 2));
        let uneven: Vec<f32> = (0..graph.links.len()).map(|k| 0.1 + (k % 5) as f32).collect();
        for weights in [vec![1.0; graph.links.len()], uneven] {
            for alpha in [0.1f32, 0.3, 3.0] {
                let (image, report) = weighted(&measurements(&primal, Some(&graph)), &graph, &weights, alpha).unwrap();
                assert!(report.residual <= TOLERANCE, "{width}×{height}, α {alpha}: {report:?}");
                for c in 0..3 {
                    let expected = dense(&primal, &graph, &weights, c, f64::from(alpha));
                    let apart = image.plane(c).iter().zip(&expected).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max);
                    // The residual's bound over the least eigenvalue, and the rounding of f32.
                    assert!(apart < 2e-4, "{width}×{height}, α {alpha}: {apart:e} apart");
                }
            }
        }
    }
}

#[test]
fn every_set_of_linked_pixels_keeps_its_mean() {
    // Two columns of three are linked within themselves; the third is alone.
    let extent = Extent { width: 3, height: 12 };
    let mut graph = linked(extent, 3);
    let links: Vec<[u32; 2]> = graph.links.iter().copied().filter(|[i, j]| i % 3 == j % 3 && i % 3 < 2).collect();
    graph.differences.truncate(links.len());
    graph.links = links.into();
    let primal = random(extent, 4, 5.0);
    let (image, _) = LeastSquares.solve(&measurements(&primal, Some(&graph)), None, 0.05).unwrap();
    let roots = roots(extent.pixels(), graph.links.iter());
    let mut sets = roots.clone();
    sets.sort_unstable();
    sets.dedup();
    assert!(sets.len() > 12, "the third column and whatever chance left alone");
    for set in sets {
        for c in 0..3 {
            let mean = |image: &Image| {
                let values: Vec<f64> = (0..extent.pixels()).filter(|i| roots[*i] == set).map(|i| f64::from(image.plane(c)[i])).collect();
                values.iter().sum::<f64>() / values.len() as f64
            };
            assert!((mean(&image) - mean(&primal)).abs() < 1e-6, "set of pixel {set}");
        }
    }
    assert_eq!(
        (2..36).step_by(3).map(|i| image.plane(0)[i]).collect::<Vec<_>>(),
        (2..36).step_by(3).map(|i| primal.plane(0)[i]).collect::<Vec<_>>()
    );
}

#[test]
fn iterations_are_bounded_by_the_weight_of_the_primal() {
    let extent = Extent { width: 150, height: 110 };
    let (primal, graph) = (random(extent, 1, 2.0), linked(extent, 2));
    for (alpha, most) in [(0.5, 70), (0.2, 160)] {
        let (_, report) = LeastSquares.solve(&measurements(&primal, Some(&graph)), None, alpha).unwrap();
        assert!(report.residual <= TOLERANCE && report.iterations <= most, "α {alpha}: {report:?}");
    }
}

#[test]
fn what_cannot_be_solved_is_refused() {
    let extent = Extent { width: 4, height: 4 };
    let primal = random(extent, 1, 2.0);
    let refused = |graph: Option<&Graph>| LeastSquares.solve(&measurements(&primal, graph), None, 0.2).unwrap_err().to_string();
    assert!(refused(None).contains("technique graph"));
    let mut graph = linked(extent, 2);
    graph.differences[2][1] = f32::NAN;
    assert!(refused(Some(&graph)).contains("not finite at index 7"));
    let none = Graph { links: Vec::new().into(), differences: Vec::new(), variances: Vec::new() };
    assert_eq!(LeastSquares.solve(&measurements(&primal, Some(&none)), None, 0.2).unwrap().0, primal);
}
