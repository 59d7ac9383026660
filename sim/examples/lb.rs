use std::sync::Arc;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let model = Arc::new(tandem_sim::RobotSource::embedded("g1_dex3").unwrap().model);
    let (a, b) = args[2].split_once('-').unwrap();
    let report = tandem_sim::bench::run(
        "g1",
        &model,
        &Default::default(),
        Default::default(),
        &args[1],
        &(a.parse().unwrap()..=b.parse().unwrap()),
        |r| println!("{r}"),
    );
    report.unwrap();
}
