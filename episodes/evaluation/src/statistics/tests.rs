//! Comparison with the figures of scipy and statsmodels, which `tests/peers/numerics/statistics.py`
//! generates.

use serde::Deserialize;

use super::*;

#[derive(Deserialize)]
struct Peers {
    clopper_pearson: Vec<PeerRate>,
    wilson: Vec<PeerRate>,
    mean: Vec<PeerMean>,
    pairs: Vec<PeerPairs>,
}

#[derive(Deserialize)]
struct PeerRate {
    count: [usize; 2],
    #[serde(rename = "interval")]
    interval_share: [f64; 2],
}

#[derive(Deserialize)]
struct PeerMean {
    counts: Vec<[usize; 2]>,
    #[serde(rename = "mean_low_high")]
    mean_low_high_share: [f64; 3],
}

#[derive(Deserialize)]
struct PeerPairs {
    pairs: [usize; 4],
    #[serde(rename = "mcnemar")]
    p_value: f64,
    #[serde(rename = "newcombe")]
    interval_share: [f64; 2],
}

fn count([successes, trials]: [usize; 2]) -> Count {
    Count { successes, trials }
}

fn check(what: &str, ours: &[f64], theirs: &[f64]) {
    let off = ours.iter().zip(theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-9, "{what}: {ours:?} here, {theirs:?} there");
}

#[test]
fn figures_are_those_of_scipy_and_statsmodels() {
    let peers: Peers = serde_json::from_str(include_str!("peers.json")).unwrap();
    for rate in &peers.clopper_pearson {
        check("Clopper and Pearson", &clopper_pearson(count(rate.count)), &rate.interval_share);
    }
    for rate in &peers.wilson {
        check("Wilson", &wilson(count(rate.count)), &rate.interval_share);
    }
    for PeerMean { counts, mean_low_high_share } in &peers.mean {
        let counts: Vec<Count> = counts.iter().copied().map(count).collect();
        let (mean, [low, high]) = mean_share(&counts).unwrap();
        check("mean", &[mean, low, high], mean_low_high_share);
    }
    for PeerPairs { pairs: [both, first_only, second_only, neither], p_value, interval_share } in &peers.pairs
    {
        let pairs =
            Pairs { both: *both, first_only: *first_only, second_only: *second_only, neither: *neither };
        check(&format!("{pairs:?}"), &[mcnemar(pairs)], &[*p_value]);
        check(&format!("{pairs:?}"), &newcombe(pairs).unwrap(), interval_share);
    }
    assert!(peers.clopper_pearson.len() > 10 && peers.pairs.len() > 8 && peers.mean.len() > 2);
}

/// Example from Statistics with Confidence (Altman et al., 2000), table 6.2. There, the first rate minus the
/// second is 0.12, with an interval from 0.01 to 0.23.
#[test]
fn the_interval_of_a_paired_difference_is_the_textbooks() {
    let pairs = Pairs { both: 14, first_only: 5, second_only: 0, neither: 22 };
    let rounded = |share: f64| (share * 100.0).round();
    assert_eq!(pairs.difference_share().map(rounded), Some(-12.0));
    assert_eq!(newcombe(pairs).map(|interval| interval.map(rounded)), Some([-23.0, -1.0]));
}

#[test]
fn without_trials_there_is_no_figure() {
    assert_eq!(Count::default().share(), None);
    assert_eq!(mean_share(&[Count::default()]), None);
    assert_eq!((newcombe(Pairs::default()), Pairs::default().difference_share()), (None, None));
    assert_eq!(mcnemar(Pairs::default()), 1.0);
}
