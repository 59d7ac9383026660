//! The active set method against Clarabel, an interior point method, on random problems.

use tandem_ik::qp::{Constraint, Qp, QpFailure};

/// Draws a number uniformly in -1..1; splitmix64.
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut bits = *state;
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

struct Problem {
    n: usize,
    /// Row major, full.
    hessian: Vec<f64>,
    linear: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// a, b, and true for an equality.
    rows: Vec<(Vec<f64>, f64, bool)>,
}

/// Creates a problem with H = B B' + 0.1 and some point inside the bounds and rows.
fn random_problem(seed: u64) -> Problem {
    let random = &mut seed.clone();
    let n = 2 + (seed % 19) as usize;
    let factor: Vec<f64> = (0..n * n).map(|_| uniform(random)).collect();
    let product = |i: usize, j: usize| (0..n).map(|k| factor[i * n + k] * factor[j * n + k]).sum::<f64>();
    let hessian =
        (0..n * n).map(|at| product(at / n, at % n) + if at / n == at % n { 0.1 } else { 0.0 }).collect();
    let inside: Vec<f64> = (0..n).map(|_| uniform(random)).collect();
    let lower = inside.iter().map(|x| x - 0.3 * uniform(random).abs()).collect();
    let upper = inside.iter().map(|x| x + 0.3 * uniform(random).abs()).collect();
    let rows = (0..seed % 7).map(|k| {
        let a: Vec<f64> = (0..n).map(|_| uniform(random)).collect();
        let value: f64 = a.iter().zip(&inside).map(|(a, x)| a * x).sum();
        let equality = k == 0 && n > 3;
        let slack = if equality { 0.0 } else { 0.1 * uniform(random).abs() };
        (a, value - slack, equality)
    });
    let rows = rows.collect();
    Problem { n, hessian, linear: (0..n).map(|_| 3.0 * uniform(random)).collect(), lower, upper, rows }
}

fn load(problem: &Problem) -> Qp {
    let mut qp = Qp::new(problem.n);
    for i in 0..problem.n {
        for j in 0..=i {
            qp.hessian[(i, j)] = problem.hessian[i * problem.n + j];
        }
    }
    qp.linear.copy_from_slice(&problem.linear);
    qp.lower.copy_from_slice(&problem.lower);
    qp.upper.copy_from_slice(&problem.upper);
    for (a, b, equality) in &problem.rows {
        let row = qp.push_row();
        row.coefficients.copy_from_slice(a);
        (row.bound, row.equality) = (*b, *equality);
    }
    qp
}

/// Solutions by Clarabel, recorded by `tests/peers/numerics/qp.py`, problem by problem.
#[derive(serde::Deserialize)]
struct Recorded {
    solutions: Vec<Vec<f64>>,
}

#[test]
fn solutions_are_clarabels() {
    let recorded = include_str!("../data/clarabel.json");
    let recorded: Recorded = serde_json::from_str(recorded).expect("solutions");
    assert_eq!(recorded.solutions.len(), 1000);
    let mut active = 0;
    for (seed, solution) in (0..).zip(&recorded.solutions) {
        let mut qp = load(&random_problem(seed));
        qp.solve().unwrap_or_else(|failure| panic!("problem {seed}: {failure:?}"));
        active += qp.active().count();
        assert_eq!(qp.x.len(), solution.len());
        for (ours, theirs) in qp.x.iter().zip(solution) {
            assert!((ours - theirs).abs() < 1e-8, "problem {seed}: {ours} against {theirs}");
        }
    }
    assert!(active > 2000, "the problems press on {active} constraints only");
}

#[test]
fn contradictions_are_named() {
    let square = |rows: Vec<(Vec<f64>, f64, bool)>, lower: f64, upper: f64| Problem {
        n: 2,
        hessian: vec![1.0, 0.0, 0.0, 1.0],
        linear: vec![0.0; 2],
        lower: vec![lower, -1.0],
        upper: vec![upper, 1.0],
        rows,
    };
    let failure = |problem: &Problem| load(problem).solve().expect_err("no solution");
    let empty_interval = failure(&square(Vec::new(), 0.5, 0.2));
    assert!(matches!(empty_interval, QpFailure::Infeasible(Constraint::Lower(0) | Constraint::Upper(0))));
    let out_of_reach = failure(&square(vec![(vec![1.0, 1.0], 3.0, false)], -1.0, 1.0));
    assert!(matches!(out_of_reach, QpFailure::Infeasible(_)), "{out_of_reach:?}");
    let opposed =
        failure(&square(vec![(vec![1.0, 0.0], 0.5, true), (vec![-1.0, 0.0], 0.0, false)], -1.0, 1.0));
    assert!(matches!(opposed, QpFailure::Infeasible(Constraint::Row(_))), "{opposed:?}");
    let mut flat = square(Vec::new(), -1.0, 1.0);
    flat.hessian[3] = -1.0;
    assert_eq!(failure(&flat), QpFailure::NotConvex);
}
