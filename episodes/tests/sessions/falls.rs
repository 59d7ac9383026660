//! Robots that fall: physics keeps its limits whatever they do.

use tandem_episodes::bench::falls;

/// Four episodes of every case, those in tasks over whole budgets. `tandem bench falls --episodes 1000` plays more.
#[test]
fn falls_stay_finite_slow_shallow_and_make_no_energy() {
    let report = falls(60, "", |case| println!("{case}")).expect("worlds");
    assert!(report.cases.iter().map(|case| case.fallen).sum::<usize>() > 30, "robots fell");
    for case in report.cases {
        let greatest = format!("{}: {:#?}", case.case, case.greatest);
        assert_eq!(case.diverged_at, Vec::<String>::new(), "{greatest}");
        assert_eq!(case.broken, Default::default(), "speed, energy, depth, range of {greatest}");
    }
}
