//! Videos of a report.

use super::*;

/// Each task has two videos, or the reasons for missing videos.
#[test]
fn films_are_of_one_success_and_one_failure() {
    let mut loaded = found(nine_six_three("agent"));
    let succeeding = tasks::find("pouring").unwrap();
    loaded.episodes.extend(found(vec![played("agent", &succeeding, 4, succeeding.phases.len())]).episodes);
    // Seeds 0 to 2 of Handover succeeded. The first of these seeds, and the first failed seed, was not
    // recorded.
    for (index, recorded) in [(1, "one"), (2, "two"), (4, "four")] {
        loaded.episodes[index].recording = Some(recorded.into());
    }
    let places = film_places(&loaded);
    let episodes: Vec<Result<(u32, Option<&str>), &str>> = places
        .iter()
        .map(|place| match &place.episode {
            Ok(found) => Ok((found.seed, found.why.as_deref())),
            Err(reason) => Err(reason.as_str()),
        })
        .collect();
    let unrecorded = "No recording of an episode that succeeded was kept; evaluate --record keeps them.";
    let ended = Some("the policy ended the episode");
    assert_eq!(episodes, [Ok((1, None)), Ok((4, ended)), Err(unrecorded), Err("No episode failed.")]);
    let contents = [
        Ok(FilmContent { webp: b"RIFF".into(), speed_ratio: 3.0 }),
        Err("a <reason>".into()),
        Err(String::new()),
        Err(String::new()),
    ];
    let films = places.into_iter().zip(contents).map(|(place, content)| Film { place, content }).collect();
    let mut pictures = ReportPictures { films, ..ReportPictures::default() };
    let page = EvaluationReport::of(&loaded).write(ReportFormat::Html, &pictures).unwrap();
    let top = page.find("data:image/webp;base64,UklGRg==").unwrap();
    assert!(top < page.find("How far episodes got").unwrap(), "films are above the figures");
    for text in [
        "agent, seed 1 (3 times as fast)",
        "From the side, faster than it was.",
        "No film of a failure. a &lt;reason&gt;",
        unrecorded,
        "No episode failed.",
    ] {
        assert!(page.contains(text), "no {text:?} in {page}");
    }
    if let Some(Ok(content)) = pictures.films.first_mut().map(|film| film.content.as_mut()) {
        content.speed_ratio = 0.2;
    }
    let page = EvaluationReport::of(&loaded).write(ReportFormat::Html, &pictures).unwrap();
    assert!(page.contains("agent, seed 1 (0.2 times as fast)") && page.contains("From the side.<"), "{page}");
}
