use tandem_episodes::players::{self, *};
use tandem_episodes::Facts; const B: usize = 1; const C: usize = 2;
use tandem_episodes::{Session, tasks};
use tandem_episodes::EpisodeSpec;
use tandem_tools_spec::{Protocol, ToolCall, ToolReply};
struct Lift { episode: InProcess, off: Option<f32>, trace: String, last: f64 }
impl Episode for Lift {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let facts = self.episode.session.facts();
        let table = facts.object("console_table").pose_in_world.inverse();
        let off = |(robot, ahead): (usize, f32)| { let p = (table * facts.robots[robot].pelvis_in_world).translation; [p.x - ahead, p.y] };
        let pair = [off((B, 0.75)), off((C, -0.75))];
        if self.off.is_none() {
            self.trace += &format!("{:.0} B {:.3} {:.3} C {:.3} {:.3} lift {:.3}\n", self.last, pair[0][0], pair[0][1], pair[1][0], pair[1][1], facts.lift_m("console_table"));
            self.last += 1.0;
            if facts.lift_m("console_table") > 0.06 { self.off = Some(pair.iter().map(|p| p[0].hypot(p[1])).fold(0.0, f32::max)); }
        }
        self.episode.call(call)
    }
}
impl PrivilegedEpisode for Lift { fn facts(&mut self) -> Result<Facts, PlayerError> { self.episode.facts() } }
fn main() {
    for seed in [2009, 2103, 2011, 2050, 2077] {
        let spec = EpisodeSpec::new(tasks::find("move_house").unwrap(), seed, Protocol::Benchmark);
        let mut lift = Lift { episode: InProcess::new(Session::start(&spec, None).unwrap()), off: None, trace: String::new(), last: 0.0 };
        players::find("expert").unwrap().play(&spec, &mut lift).unwrap();
        println!("{seed} off {:?} phases {}", lift.off, lift.episode.session.reached_phases());
        if std::env::var("TRACE").is_ok() { let lines: Vec<_> = lift.trace.lines().collect(); for l in lines.iter().rev().take(45).rev() { println!("{l}"); } }
    }
}
