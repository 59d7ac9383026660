fn main() {
    let args: Vec<String> = std::env::args().collect();
    let (a, b) = args[2].split_once('-').unwrap();
    let seeds = a.parse().unwrap()..=b.parse().unwrap();
    tandem_episodes::bench::locomotion(&Default::default(), &Default::default(), Default::default(), &args[1], &seeds, |r| println!("{r}")).unwrap();
}
