//! Draws a plot with the SVG back end.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::{Logarithmic, has_logarithm};
use super::theme;
use super::{Plot, PlotError, Series, Stroke};

/// Height of letters [pixels].
const TEXT: u32 = 14;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Logarithmic, Logarithmic>>;

/// The whole picture.
pub(super) fn svg(plot: &Plot) -> Result<String, PlotError> {
    let (x, y) = axes(plot).ok_or(PlotError::Empty)?;
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, (Plot::WIDTH, Plot::HEIGHT)).into_drawing_area();
        draw(plot, &area, x, y).map_err(|fault| PlotError::Drawing(fault.to_string()))?;
        area.present().map_err(|fault| PlotError::Drawing(fault.to_string()))?;
    }
    // The element gets a name for its style sheet, which comes first inside it, and grows with its page.
    let size = format!("<svg width=\"{}\" height=\"{}\"", Plot::WIDTH, Plot::HEIGHT);
    let named = format!("<svg class=\"gradfarm-plot\" role=\"img\" width=\"{}\" height=\"{}\"", Plot::WIDTH, Plot::HEIGHT);
    let text = text.replacen(&size, &named, 1);
    match text.find('>') {
        Some(end) => Ok(format!("{}{}{}", &text[..=end], theme::style(), &text[end + 1..])),
        None => Err(PlotError::Drawing("the back end wrote no element".to_owned())),
    }
}

/// Axes that hold everything; a level or a mark alone makes none.
fn axes(plot: &Plot) -> Option<(Logarithmic, Logarithmic)> {
    let drawn: Vec<(f64, f64)> = plot.series.iter().flat_map(sound).collect();
    if drawn.is_empty() {
        return None;
    }
    let x = drawn.iter().map(|(x, _)| *x).chain(plot.marks.iter().map(|mark| mark.x));
    let y = drawn.iter().map(|(_, y)| *y).chain(plot.levels.iter().map(|level| level.y)).chain(plot.marks.iter().map(|mark| mark.y));
    let (x, y) = (Logarithmic::over(x)?, Logarithmic::over(y)?);
    // Bands may reach far down; beyond a decade below the curve they are cut off.
    let lows = plot.series.iter().flat_map(|series| &series.band).map(|(_, low, _)| low.max(0.1 * y.from()));
    let highs = plot.series.iter().flat_map(|series| &series.band).map(|(_, _, high)| high.min(10.0 * y.to()));
    let y = Logarithmic::over(lows.chain(highs).chain([y.from(), y.to()]))?;
    Some((x, y))
}

/// Points that have a place.
fn sound(series: &Series) -> impl Iterator<Item = (f64, f64)> {
    series.points.iter().copied().filter(|(x, y)| has_logarithm(*x) && has_logarithm(*y))
}

fn draw(plot: &Plot, area: &Area<'_>, x: Logarithmic, y: Logarithmic) -> Result<(), Box<dyn std::error::Error>> {
    let font = |size: u32, colour: RGBColor| ("sans-serif", size).into_font().color(&colour);
    area.fill(&theme::PAPER)?;
    let (left, right, bottom, top) = (x.from(), x.to(), y.from(), y.to());
    let mut chart = ChartBuilder::on(area)
        .caption(&plot.title, font(TEXT + 3, theme::INK))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(72)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .x_desc(&plot.x)
        .y_desc(&plot.y)
        .x_labels(9)
        .y_labels(9)
        .max_light_lines(0)
        .bold_line_style(theme::RULE)
        .axis_style(theme::INK)
        .label_style(font(TEXT - 1, theme::INK))
        .axis_desc_style(font(TEXT, theme::INK))
        .draw()?;
    for (place, series) in plot.series.iter().enumerate() {
        curve(&mut chart, series, theme::curve(series.colour.unwrap_or(place)), bottom)?;
    }
    for level in plot.levels.iter().filter(|level| has_logarithm(level.y)) {
        let line = [(left, level.y), (right, level.y)];
        chart.draw_series(DashedLineSeries::new(line, 6, 4, theme::LEVEL.stroke_width(2)))?;
        let style = font(TEXT - 1, theme::LEVEL).pos(Pos::new(HPos::Right, VPos::Bottom));
        let place = (right / (right / left).powf(0.01), level.y * (top / bottom).powf(0.008));
        chart.draw_series([Text::new(level.name.clone(), place, style)])?;
    }
    for mark in plot.marks.iter().filter(|mark| has_logarithm(mark.x) && has_logarithm(mark.y)) {
        // Near the right end the text stands on the left.
        let (side, away) = if mark.x > right / (right / left).powf(0.3) { (HPos::Right, -7) } else { (HPos::Left, 7) };
        let style = font(TEXT - 2, theme::INK).pos(Pos::new(side, VPos::Bottom));
        let dot = EmptyElement::at((mark.x, mark.y))
            + Circle::new((0, 0), 4, theme::INK.stroke_width(2))
            + Text::new(mark.text.clone(), (away, -5), style);
        chart.draw_series([dot])?;
    }
    if plot.series.iter().any(|series| !series.name.is_empty()) {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::LowerLeft)
            .margin(10)
            .background_style(theme::PAPER.mix(0.85))
            .border_style(theme::RULE)
            .label_font(font(TEXT - 1, theme::INK))
            .draw()?;
    }
    Ok(())
}

fn curve(chart: &mut Chart<'_, '_>, series: &Series, colour: RGBColor, bottom: f64) -> Result<(), Box<dyn std::error::Error>> {
    let points: Vec<(f64, f64)> = sound(series).collect();
    let band: Vec<(f64, f64, f64)> = series.band.iter().copied().filter(|(x, _, high)| has_logarithm(*x) && has_logarithm(*high)).collect();
    if band.len() > 1 {
        let upper = band.iter().map(|(x, _, high)| (*x, *high));
        // What reaches down to nothing ends at the axis.
        let lower = band.iter().rev().map(|(x, low, _)| (*x, if *low > bottom { *low } else { bottom }));
        chart.draw_series([Polygon::new(upper.chain(lower).collect::<Vec<_>>(), colour.mix(0.18).filled())])?;
    } else if let [(x, low, high)] = band[..] {
        chart.draw_series([PathElement::new([(x, low.max(bottom)), (x, high)], colour.mix(0.5).stroke_width(3))])?;
    }
    let line = colour.stroke_width(2);
    let drawn = match series.stroke {
        Stroke::Line => chart.draw_series(LineSeries::new(points.iter().copied(), line))?,
        Stroke::Dashed => chart.draw_series(DashedLineSeries::new(points.iter().copied(), 7, 5, line))?,
        Stroke::Dots => chart.draw_series(points.iter().map(|point| Circle::new(*point, 3, colour.filled())))?,
    };
    if !series.name.is_empty() {
        let dots = series.stroke == Stroke::Dots;
        drawn.label(series.name.as_str()).legend(move |(x, y)| {
            let (from, to) = if dots { ((x + 9, y), (x + 11, y)) } else { ((x, y), (x + 20, y)) };
            PathElement::new([from, to], colour.stroke_width(if dots { 5 } else { 2 }))
        });
    }
    if series.stroke == Stroke::Line {
        chart.draw_series(points.iter().map(|point| Circle::new(*point, 3, colour.filled())))?;
    }
    Ok(())
}
