//! Figures as files.

use roxmltree::Document;

use super::*;

/// Writes both figures, parses them, and returns them.
fn figures(episodes: Vec<PlayedEpisode>) -> [String; 2] {
    let report = EvaluationReport::of(&found(episodes));
    [ReportFormat::Svg, ReportFormat::TimesSvg].map(|format| {
        let text = report.write(format, &ReportPictures::default()).unwrap();
        let document = Document::parse(&text).unwrap_or_else(|error| panic!("{error}: {text}"));
        let [width_px, height_px] = ["width", "height"]
            .map(|name| document.root_element().attribute(name).unwrap().parse::<f64>().unwrap());
        assert!(width_px > 370.0 && height_px > 200.0, "{text}");
        assert!(!text.contains("var("), "programs that convert figures know no variables: {text}");
        text
    })
}

#[test]
fn figures_name_every_policy_and_task() {
    let mut episodes = nine_six_three("a<b>&\"c\"");
    episodes.extend(nine_six_three("other"));
    episodes.push(played("other", &tasks::find("pouring").unwrap(), 1, 0));
    let [rates, times] = figures(episodes);
    for text in [&rates, &times] {
        let document = Document::parse(text).unwrap();
        let words: Vec<&str> = document.descendants().filter_map(|node| node.text()).collect();
        for expected in ["a<b>&\"c\"", "other", "handover"] {
            assert!(words.contains(&expected), "no {expected}: {words:?}");
        }
    }
    assert!(rates.contains(">pouring</text>") && !times.contains(">pouring</text>"));
    assert!(times.contains("No phase was reached of pouring"), "{times}");
}

/// Nine, six and three of ten episodes reached the phases after 4, 8 and 12 s.
#[test]
fn curves_step_up_where_episodes_reached_a_phase() {
    let report = EvaluationReport::of(&found(nine_six_three("agent")));
    let phases = &report.policies[0].tasks[0].phases;
    assert_eq!(phases[2].reached_s, [12.0; 3]);
    let [_, times] = figures(nine_six_three("agent"));
    let document = Document::parse(&times).unwrap();
    let curves: Vec<&str> = document
        .descendants()
        .filter(|node| {
            node.has_children() && node.attribute("class").is_some_and(|c| c.starts_with("curve d"))
        })
        .filter_map(|node| node.attribute("d"))
        .collect();
    // 310 px correspond to 12 s, and 160 px to all episodes.
    let ends: Vec<Option<&str>> = curves.iter().map(|path| path.rsplit('H').nth(1)).collect();
    assert_eq!(ends, [Some("143.3V26.0"), Some("246.7V74.0"), Some("350.0V122.0")], "{curves:?}");
}
