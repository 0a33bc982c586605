//! Studies as text: rows for people in Markdown, and every run as CSV.

use super::{MethodStudy, SceneStudy, Study};

/// First lines of the table.
pub const HEAD: [&str; 2] = [
    "| scene | method | samples | time | relMSE | seeds | FLIP | slope | equal time | time to equal error |",
    "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|",
];

/// The rows of a scene: each method at the largest budget.
pub fn rows(scene: &SceneStudy) -> Vec<String> {
    let Some(base) = scene.methods.first() else { return Vec::new() };
    scene.methods.iter().filter_map(|method| row(scene, method, base)).collect()
}

fn row(scene: &SceneStudy, method: &MethodStudy, base: &MethodStudy) -> Option<String> {
    let last = method.points.last()?;
    let [low, high] = last.range();
    let slope = method.law().map_or(String::new(), |law| format!("{:.2}", law.slope));
    let times = |ratio: Option<f64>| ratio.map_or(String::new(), |ratio| format!("{ratio:.1}×"));
    Some(format!(
        "| {} | {} | {:.0} | {:.2} s | {:.2e} | {:.1e}–{:.1e} | {:.3} | {slope} | {} | {} |",
        scene.name,
        method.name,
        last.samples(),
        last.seconds(),
        last.relmse(),
        low,
        high,
        last.flip(),
        times(method.equal_time(base, method.points.len() - 1)),
        method.equal_error(base).map_or(String::new(), |sooner| sooner.to_string()),
    ))
}

/// Every run as comma-separated values with a header, after RFC 4180.
pub fn csv(study: &Study) -> String {
    let mut text = String::from("scene,method,budget,seed,samples,seconds,relmse,flip,estimated_relmse\r\n");
    for scene in &study.scenes {
        for method in &scene.methods {
            for point in &method.points {
                for run in &point.runs {
                    let told = run.estimated_relmse.map_or(String::new(), |told| told.to_string());
                    text += &format!(
                        "{},{},{},{},{},{},{},{},{told}\r\n",
                        quoted(&scene.name),
                        quoted(&method.name),
                        point.budget,
                        run.seed,
                        run.samples,
                        run.seconds,
                        run.relmse,
                        run.flip
                    );
                }
            }
        }
    }
    text
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\r', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::tests::method;

    #[test]
    fn rows_and_runs() {
        let scene = SceneStudy {
            name: "a \"hall\", large".to_owned(),
            width: 8,
            height: 6,
            reference: "given".to_owned(),
            reference_relmse: None,
            methods: vec![method("pt", 1.0, -1.0), method("gpt+l2", 0.2, -1.0)],
        };
        let rows = rows(&scene);
        assert!(
            rows[0].contains("| pt | 40 | 4.00 s | 2.50e-1 | 2.3e-1–2.8e-1 |") && rows[0].ends_with("| -1.00 | 1.0× | 1.0× |"),
            "{}",
            rows[0]
        );
        assert!(rows[1].ends_with("| 5.0× | ≥ 4.0× |"), "{}", rows[1]);
        let columns = |line: &str| line.matches('|').count();
        assert!(rows.iter().all(|row| columns(row) == columns(HEAD[0]) && columns(row) == columns(HEAD[1])));
        let study = Study { version: String::new(), command: String::new(), machine: String::new(), scenes: vec![scene] };
        let csv = csv(&study);
        let lines: Vec<&str> = csv.split_terminator("\r\n").collect();
        assert_eq!(lines.len(), 1 + 2 * 3 * 2);
        assert_eq!(lines[1], "\"a \"\"hall\"\", large\",pt,1,0,10,1,0.9,0.1,1");
    }
}
