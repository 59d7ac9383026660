//! `tandem report`: results of episodes, for people and for programs.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use tandem_episodes::replay::{ShortFilm, short_film};
use tandem_episodes::{Recording, build, printable, write_whole};
use tandem_evaluation::reports::{
    EvaluationReport, Film, FilmContent, FilmPlace, FilmedEpisode, ReportFormat, ReportOrigin,
    ReportPictures, failure_moments, film_places, gallery, load, pictured_failures,
};

use super::CommandResult;
use crate::settings::one_of;

/// Report on episodes: rates with intervals, averages, effort, failures, and policies compared on the same
/// seeds.
#[derive(Debug, clap::Args)]
pub struct ReportArgs {
    /// Folders written by `evaluate`, `collect` or `serve`; results of one policy are joined.
    #[arg(value_name = "DIR", required = true)]
    folders: Vec<PathBuf>,
    /// Format of the report: a self-contained page, Markdown, a line for each rate, all figures, tables for
    /// LaTeX, a line for each episode, a figure of the rates or of the times of phases, or a row for each
    /// episode in Parquet.
    #[arg(long, default_value = ReportFormat::Html.name(), value_parser = one_of(FileFormat::all(), FileFormat::name))]
    format: FileFormat,
    /// File to write [default: report.FORMAT in the first folder].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Maximum number of failures to show with images and moments, if episodes were recorded.
    #[arg(long, value_name = "N", default_value_t = 12)]
    failures: usize,
}

/// Format of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FileFormat {
    Text(ReportFormat),
    EpisodesParquet,
}

impl FileFormat {
    fn all() -> [FileFormat; ReportFormat::ALL.len() + 1] {
        std::array::from_fn(|index| {
            ReportFormat::ALL.get(index).map_or(FileFormat::EpisodesParquet, |text| FileFormat::Text(*text))
        })
    }

    fn name(self) -> &'static str {
        match self {
            FileFormat::Text(format) => format.name(),
            FileFormat::EpisodesParquet => "episodes.parquet",
        }
    }
}

/// Reads the results and writes the report.
pub fn run(args: ReportArgs) -> CommandResult {
    let loaded = load(&args.folders)?;
    let default = args.folders.first().map(|folder| folder.join(format!("report.{}", args.format.name())));
    let path = args.out.or(default).unwrap_or_else(|| "report.html".into());
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut report = EvaluationReport::of(&loaded);
    report.header.made = Some(ReportOrigin::here(build()?));
    report.failure_moments = failure_moments(&loaded, args.failures, folder);
    let pictures = match args.format {
        FileFormat::Text(ReportFormat::Html) => ReportPictures {
            films: film_places(&loaded).into_iter().map(film).collect(),
            failures: gallery(&loaded, args.failures),
            pictured_failures: pictured_failures(&loaded),
        },
        FileFormat::Text(_) | FileFormat::EpisodesParquet => ReportPictures::default(),
    };
    let content = match args.format {
        FileFormat::Text(format) => report.write(format, &pictures)?.into_bytes(),
        FileFormat::EpisodesParquet => report.episodes_parquet(),
    };
    write_whole(&path, &content)?;
    let films = pictures.films.iter().filter(|film| film.content.is_ok()).count();
    let films = if films > 0 { format!(", {films} films") } else { String::new() };
    let size_mb = content.len() as f64 / 1e6;
    let excluded = report.policies.iter().flat_map(|policy| &policy.excluded).map(|entry| entry.seeds.len());
    let excluded = match excluded.sum() {
        0 => String::new(),
        count => format!(" ({count} not counted)"),
    };
    let episodes = loaded.episodes.len();
    println!("{}: {episodes} episodes{excluded}{films}, {size_mb:.1} MB", path.display());
    loaded.skipped.iter().for_each(|skipped| eprintln!("left out: {}", printable(skipped)));
    Ok(ExitCode::SUCCESS)
}

/// Renders the film of an episode. If that fails, the film contains the reason instead.
fn film(place: FilmPlace) -> Film {
    let content = place.episode.clone().and_then(|FilmedEpisode { recording, .. }| {
        let read = Recording::read(&recording).map_err(|error| error.to_string())?;
        let ShortFilm { webp, speed_ratio } = short_film(&read).map_err(|error| error.to_string())?;
        Ok(FilmContent { webp, speed_ratio })
    });
    Film { place, content }
}
