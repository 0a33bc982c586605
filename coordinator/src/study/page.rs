//! A study as one HTML file that needs nothing else: plots, tables, images.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{MethodStudy, SceneStudy, Study};
use crate::plot::{Plot, PlotError, Series, Stroke, number};

/// What a method shows at the largest budget, as PNG files.
#[derive(Clone, Debug)]
pub struct Views {
    /// Whose.
    pub method: String,
    /// The image.
    pub image: Vec<u8>,
    /// A part of it.
    pub part: Vec<u8>,
    /// Where it is wrong; `None` for the reference.
    pub error: Option<Vec<u8>>,
}

/// Convergence of a scene's methods: error against time, with the spread over seeds.
pub fn plot(scene: &SceneStudy) -> Plot {
    let curve = |(place, method): (usize, &MethodStudy)| Series {
        name: method.name.clone(),
        points: method.points.iter().map(|point| (point.seconds(), point.relmse())).collect(),
        band: method.points.iter().map(|point| (point.seconds(), point.range()[0], point.range()[1])).collect(),
        stroke: Stroke::Line,
        colour: Some(place),
    };
    Plot {
        title: format!("{}: error against time", scene.name),
        x: "time, reconstruction included [s]".to_owned(),
        y: "relMSE [1]".to_owned(),
        series: scene.methods.iter().enumerate().map(curve).collect(),
        ..Plot::default()
    }
}

/// The page. `views` has the images of each scene, in the study's order; the reference is the first of each.
///
/// # Errors
/// If a scene has nothing to plot.
pub fn page(study: &Study, views: &[Vec<Views>]) -> Result<String, PlotError> {
    let plots = study.scenes.iter().map(|scene| plot(scene).to_svg()).collect::<Result<Vec<_>, _>>()?;
    let body = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "What accuracy costs" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "What accuracy costs" }
                p {
                    "Methods on the same scenes in the same time, reconstruction included. relMSE is the mean over pixels and channels of "
                    "(image − reference)² / (grey² + 10⁻³). Times of one study may be compared with each other, not with those of another."
                }
                dl {
                    dt { "Command" } dd { code { (study.command) } }
                    dt { "Version" } dd { "gradfarm " (study.version) }
                    dt { "Machine" } dd { (study.machine) }
                }
                @for (k, scene) in study.scenes.iter().enumerate() {
                    (section(scene, &plots[k], views.get(k).map_or(&[][..], Vec::as_slice)))
                }
            }
        }
    };
    Ok(body.into_string())
}

fn section(scene: &SceneStudy, plot: &str, views: &[Views]) -> Markup {
    html! {
        section {
            h2 { (scene.name) }
            p {
                (scene.width) " × " (scene.height) " pixels. Reference: " (scene.reference)
                @if let Some(relmse) = scene.reference_relmse { ", its own relMSE about " (number(relmse)) }
                "."
            }
            figure { (PreEscaped(plot)) figcaption { "Means over seeds; the bands reach from the best seed to the worst." } }
            (summary(scene))
            (by_budget(scene))
            (gallery(views))
        }
    }
}

fn times(ratio: Option<f64>) -> String {
    ratio.map_or("–".to_owned(), |ratio| format!("{ratio:.1}×"))
}

/// What each method is worth at the largest budget.
fn summary(scene: &SceneStudy) -> Markup {
    let Some(base) = scene.methods.first() else { return html! {} };
    html! {
        table {
            caption { "At the largest budget, compared with " (base.name) }
            thead { tr {
                th scope="col" { "Method" } th scope="col" { "Samples" } th scope="col" { "Time" } th scope="col" { "relMSE" }
                th scope="col" { "FLIP" } th scope="col" { "Slope" } th scope="col" { "Error, equal time" } th scope="col" { "Time, equal error" }
                th scope="col" { "Next halving" }
            } }
            tbody {
                @for method in &scene.methods {
                    @if let Some(last) = method.points.last() {
                        tr {
                            th scope="row" { (method.name) }
                            td { (number(last.samples().round())) }
                            td { (number(last.seconds())) " s" }
                            td { (number(last.relmse())) }
                            td { (number(last.flip())) }
                            td { (method.law().map_or("–".to_owned(), |law| format!("{:.2}", law.slope))) }
                            td { (times(method.equal_time(base, method.points.len() - 1))) }
                            td { (method.equal_error(base).map_or("–".to_owned(), |sooner| sooner.to_string())) }
                            td { (halving(method)) }
                        }
                    }
                }
            }
        }
    }
}

/// What half the error at the largest budget costs beyond it.
fn halving(method: &MethodStudy) -> String {
    let more = method.law().zip(method.points.last()).and_then(|(law, last)| {
        let seconds = law.seconds_for(0.5 * law.level * last.seconds().powf(law.slope))?;
        Some(seconds - last.seconds())
    });
    more.map_or("–".to_owned(), |more| format!("{} s more", number(more)))
}

/// Error ratios at each budget.
fn by_budget(scene: &SceneStudy) -> Markup {
    let Some(base) = scene.methods.first().filter(|base| base.points.len() > 1) else { return html! {} };
    html! {
        table {
            caption { "How many times smaller the error is at equal time" }
            thead { tr { th scope="col" { "Method" } @for point in &base.points { th scope="col" { (number(point.budget)) " s" } } } }
            tbody {
                @for method in &scene.methods {
                    tr { th scope="row" { (method.name) } @for k in 0..base.points.len() { td { (times(method.equal_time(base, k))) } } }
                }
            }
        }
    }
}

fn gallery(views: &[Views]) -> Markup {
    if views.is_empty() {
        return html! {};
    }
    html! {
        div class="views" {
            @for view in views {
                figure {
                    figcaption { (view.method) }
                    (picture(&view.image, &format!("image by {}", view.method)))
                    (picture(&view.part, &format!("part of the image by {}, close up", view.method)))
                    @if let Some(error) = &view.error { (picture(error, &format!("error of {}", view.method))) }
                }
            }
        }
        p class="key" { "Below each image a part of it, and its relative squared error: blue 10⁻⁴ and less, sky 10⁻³, green 10⁻², yellow 10⁻¹, red 1 and more." }
    }
}

fn picture(png: &[u8], told: &str) -> Markup {
    html! { img alt=(told) src=(format!("data:image/png;base64,{}", STANDARD.encode(png))); }
}

const STYLE: &str = "\
:root{color-scheme:light dark}\
body{font:16px/1.5 system-ui,sans-serif;max-width:70rem;margin:2rem auto;padding:0 1rem}\
h1,h2{line-height:1.2}section{margin-top:3rem}\
table{border-collapse:collapse;margin:1rem 0;display:block;overflow-x:auto}caption{text-align:left;white-space:nowrap;font-weight:600;padding:.25rem 0}\
th,td{padding:.25rem .6rem;border-bottom:1px solid color-mix(in srgb,currentColor 25%,transparent);text-align:right;font-variant-numeric:tabular-nums}\
th:first-child{text-align:left}\
dt{font-weight:600}dd{margin:0 0 .5rem}code{overflow-wrap:anywhere}\
figure{margin:1rem 0}figure svg{max-width:100%;height:auto}\
.views{display:grid;grid-template-columns:repeat(auto-fill,minmax(12rem,1fr));gap:1rem}.views figure{margin:0}\
.views img{width:100%;image-rendering:pixelated;display:block;margin:.25rem 0}figcaption,.key{font-size:.9rem}";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::tests::method;

    #[test]
    fn the_page_holds_everything_and_asks_for_nothing() {
        let scene = SceneStudy {
            name: "<hall> & door".to_owned(),
            width: 80,
            height: 60,
            reference: "gpt + l2".to_owned(),
            reference_relmse: Some(1e-4),
            methods: vec![method("pt", 1.0, -1.0), method("gpt+l2", 0.2, -1.0)],
        };
        let study = Study {
            version: "1.2".to_owned(),
            command: "gradfarm study a.json --seeds 2".to_owned(),
            machine: "some processor".to_owned(),
            scenes: vec![scene],
        };
        let view = |method: &str, error| Views { method: method.to_owned(), image: vec![1, 2, 3], part: vec![4], error };
        let page = page(&study, &[vec![view("reference", None), view("pt", Some(vec![5]))]]).unwrap();
        for part in
            ["&lt;hall&gt; &amp; door", "5.0×", "<svg", "gpt+l2", "4 s more", "data:image/png;base64,AQID", "--seeds 2", "some processor"]
        {
            assert!(page.contains(part), "{part} is missing");
        }
        assert_eq!(page.matches("<img").count(), 5);
        for outside in ["src=\"http", "href=", "<script", "url("] {
            assert!(!page.contains(outside), "the page asks for {outside}");
        }
        assert!(super::page(&Study { scenes: vec![SceneStudy { methods: Vec::new(), ..study.scenes[0].clone() }], ..study }, &[]).is_err());
    }
}
