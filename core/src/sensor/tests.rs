//! Where cameras look.

use super::*;

const THIN_LENS: Perspective =
    Perspective { half_tangent: 1.0, axis: FieldAxis::X, principal_point: [0.0; 2], lens_radius: 0.1, focus_distance: 3.0 };

fn sensor(projection: Projection, window: Window) -> Sensor {
    Sensor { to_world: Transform::IDENTITY, projection, window, filter: PixelFilter::Box }
}

fn whole(perspective: Perspective) -> View {
    sensor(Projection::Perspective(perspective), Window::WHOLE).view(Extent { width: 20, height: 10 })
}

#[test]
fn field_of_view_and_focus() {
    let view = whole(THIN_LENS);
    // All lens positions meet in the plane of focus.
    let at_focus = |lens| {
        let ray = view.ray([20.0, 5.0], lens);
        ray.origin + ray.direction * (3.0 / ray.direction.z)
    };
    assert!((at_focus([0.1, 0.9]) - Vec3::new(3.0, 0.0, 3.0)).length() < 1e-5);
    assert!((at_focus([0.7, 0.2]) - Vec3::new(3.0, 0.0, 3.0)).length() < 1e-5);
    let up = whole(Perspective { lens_radius: 0.0, ..THIN_LENS }).ray([10.0, 0.0], [0.5, 0.5]);
    assert!((up.direction - Vec3::new(0.0, 0.5, 1.0).normalize()).length() < 1e-6);
}

#[test]
fn the_line_of_sight_meets_the_film_at_the_principal_point() {
    let view = whole(Perspective { principal_point: [0.25, -0.1], lens_radius: 0.0, ..THIN_LENS });
    // 0.5 + 0.25 of 20 columns, 0.5 − 0.1 of 10 rows.
    assert!((view.ray([15.0, 4.0], [0.5; 2]).direction - Vec3::Z).length() < 1e-6);
    let left = view.ray([0.0, 4.0], [0.5; 2]).direction;
    assert!((left - Vec3::new(-1.5, 0.0, 1.0).normalize()).length() < 1e-6);
}

#[test]
fn parallel_rays_are_as_far_apart_as_the_film_says() {
    let view = sensor(Projection::Orthographic(2.0), Window::WHOLE).view(Extent { width: 20, height: 10 });
    let corner = view.ray([0.0, 0.0], [0.3, 0.9]);
    assert_eq!(corner.direction, Vec3::Z);
    assert!((corner.origin - Vec3::new(-2.0, 1.0, 0.0)).length() < 1e-6);
    assert!((view.ray([20.0, 10.0], [0.5; 2]).origin - Vec3::new(2.0, -1.0, 0.0)).length() < 1e-6);
}

#[test]
fn a_window_sees_its_part_of_the_film() {
    let window = Window { corner: [5.0 / 20.0, 2.0 / 10.0], size: [8.0 / 20.0, 6.0 / 10.0] };
    for projection in [Projection::Perspective(Perspective { axis: FieldAxis::Smaller, ..THIN_LENS }), Projection::Orthographic(3.0)] {
        let part = sensor(projection, window).view(Extent { width: 8, height: 6 });
        let all = sensor(projection, Window::WHOLE).view(Extent { width: 20, height: 10 });
        for film in [[0.0f32, 0.0], [8.0, 6.0], [3.3, 1.7]] {
            let (a, b) = (part.ray(film, [0.2, 0.6]), all.ray([film[0] + 5.0, film[1] + 2.0], [0.2, 0.6]));
            assert!((a.origin - b.origin).length() < 1e-5 && (a.direction - b.direction).length() < 1e-5, "{film:?}");
        }
    }
}

#[test]
fn what_a_ray_meets_is_seen_where_it_started() {
    let window = Window { corner: [5.0 / 20.0, 2.0 / 10.0], size: [8.0 / 20.0, 6.0 / 10.0] };
    let pinhole = Perspective { lens_radius: 0.0, principal_point: [0.1, -0.2], ..THIN_LENS };
    let turn = Transform::from_rows([[0.6, 0.0, 0.8, 1.0], [0.0, 1.0, 0.0, -2.0], [-0.8, 0.0, 0.6, 0.5]]).unwrap();
    for projection in [Projection::Perspective(pinhole), Projection::Orthographic(3.0)] {
        let view = Sensor { to_world: turn, ..sensor(projection, window) }.view(Extent { width: 8, height: 6 });
        for film in [[0.0f32, 0.0], [7.9, 5.1], [3.3, 1.7], [-2.0, 9.0]] {
            let ray = view.ray(film, [0.5; 2]);
            let [x, y] = view.project(ray.origin + ray.direction * 7.0).unwrap();
            assert!((x - film[0]).abs() < 1e-4 && (y - film[1]).abs() < 1e-4, "{film:?}: {x}, {y}");
            let far = view.project_direction(ray.direction);
            match projection {
                Projection::Perspective(_) => {
                    let [x, y] = far.unwrap();
                    assert!((x - film[0]).abs() < 1e-4 && (y - film[1]).abs() < 1e-4, "{film:?}: {x}, {y}");
                }
                Projection::Orthographic(_) => assert_eq!(far, None),
            }
            assert_eq!(view.project(ray.origin - ray.direction * 7.0), None);
        }
    }
}
