//! Is the light right? Furnaces, whose answer is 1, and closed forms within their statistical error.

use crate::staging::{film, scene};
use core::f64::consts::PI;
use geometry::Vec3;
use render_node::Film;

/// Mean of a channel over all pixels, and the standard error of that mean from the spread of the pixels, which are
/// independent of each other.
fn mean_and_error(film: &Film, channel: usize) -> (f64, f64) {
    let count = film.rgb.len() as f64;
    let mean = film.rgb.iter().map(|pixel| pixel[channel]).sum::<f64>() / count;
    let squares = film.rgb.iter().map(|pixel| (pixel[channel] - mean) * (pixel[channel] - mean)).sum::<f64>();
    (mean, (squares / (count - 1.0) / count).sqrt())
}

/// A z-test: the mean must lie within four and a half standard errors of the expected value (7e-6 by chance, and
/// the random numbers are the same in every run) and the error must be small enough to mean something.
fn check_mean(what: &str, film: &Film, expected: f64) {
    let (mean, error) = mean_and_error(film, 0);
    let z = (mean - expected) / error;
    println!("{what}: {mean:.6} +- {error:.6}, expected {expected:.6}, z = {z:.2} (limit 4.5)");
    assert!(error < 0.01 * expected, "{what}: the error {error} is too large to test {expected}");
    assert!(z.abs() < 4.5 || (mean - expected).abs() < 1e-9 * expected, "{what}: z = {z}");
}

/// A white-grey plane z = 0 seen from above at its origin through a narrow angle, so that the picture is one point.
const PLANE_AT_ORIGIN: &str = "
    plane = [{ normal = [0, 0, 1], offset_m = 0.0, material = 'a' }]
    render.look.a.albedo = [0.7, 0.7, 0.7]
    render.sky.zenith_radiance = [0, 0, 0]
    render.sky.horizon_radiance = [0, 0, 0]
    render.camera = { position_m = [3, 0, 4], look_at_m = [0, 0, 0], up = [0, 0, 1], vertical_field_of_view_rad = 1e-5 }
    render.width_px = 48
    render.height_px = 48
    render.samples_per_pixel = 8
    render.bounces_max = 0
";

/// Irradiance on the plane z = 0 at the origin from a polygon above it that shines with radiance 1.
///
/// # Source
/// Lambert's formula: half the sum over the edges of the angle they span times the z of their planes' unit normals.
fn irradiance_of_polygon(corners: &[Vec3]) -> f64 {
    let mut sum = 0.0;
    for (index, a) in corners.iter().enumerate() {
        let b = &corners[(index + 1) % corners.len()];
        let normal = a.cross(b).normalize();
        sum += libm::acos(a.dot(b) / (a.norm() * b.norm())) * normal.z;
    }
    0.5 * sum.abs()
}

#[test]
fn white_bodies_in_a_white_sky_are_white() {
    let film = film(&scene(
        "
        ring = [
            { major_radius_m = 1.0, minor_radius_m = 0.3, mass_kg = 1.0, material = 'white', position_m = [0, 0, 0] },
            { major_radius_m = 0.8, minor_radius_m = 0.1, mass_kg = 1.0, material = 'white', position_m = [0.9, 0, 0], orientation = [0.6, 0, 0, 0.8] },
        ]
        sphere = [{ radius_m = 0.5, mass_kg = 1.0, material = 'white', position_m = [0, 0.1, -0.2] }]
        plane = [{ normal = [0, 0, 1], offset_m = -1.0, material = 'white' }]
        render.sky.zenith_radiance = [1, 1, 1]
        render.sky.horizon_radiance = [1, 1, 1]
        render.camera = { position_m = [1, 2, 4], vertical_field_of_view_rad = 0.9 }
        render.width_px = 48
        render.height_px = 48
        render.samples_per_pixel = 16
        render.bounces_max = 256
        ",
    ));
    // Every factor is 1, so a sample is exactly 1 unless its path is cut off, and then exactly 0. The least open
    // place here sees well over a tenth of the sky: 0.9^256 = 2e-12 of the paths are cut off.
    assert!(film.rgb.iter().all(|pixel| *pixel == [1.0; 3]));
    assert!(film.rays > 48 * 48 * 16 * 2, "{} rays: the camera sees the bodies", film.rays);
}

#[test]
fn grey_ball_in_a_white_sky_has_its_albedo() {
    let film = film(&scene(
        "
        sphere = [{ radius_m = 1.0, mass_kg = 1.0, material = 'a', position_m = [0, 0, 0] }]
        render.look.a.albedo = [0.5, 0.25, 0.0]
        render.sky.zenith_radiance = [1, 1, 1]
        render.sky.horizon_radiance = [1, 1, 1]
        render.camera.vertical_field_of_view_rad = 0.2
        render.width_px = 16
        render.height_px = 16
        ",
    ));
    assert!(film.rgb.iter().all(|pixel| *pixel == [0.5, 0.25, 0.0]));
}

#[test]
fn ball_light_over_a_plane() {
    // A sphere light above the horizon gives the irradiance pi L (r / d)^2 cos(angle).
    for (position, radius) in [([0.0, 0.0, 3.0], 1.0), ([4.0, -1.0, 3.0], 0.4), ([-1.0, 1.0, 1.0], 0.95)] {
        let [x, y, z] = position;
        let light = format!(
            "render.light = [{{ shape = 'sphere', position_m = [{x}, {y}, {z}], radius_m = {radius}, radiance = [5, 5, 5] }}]"
        );
        let distance_squared: f64 = x * x + y * y + z * z;
        let expected = 0.7 * 5.0 * radius * radius / distance_squared * z / distance_squared.sqrt();
        check_mean(
            &format!("ball {position:?}"),
            &film(&scene(&format!("{PLANE_AT_ORIGIN}{light}"))),
            expected,
        );
    }
}

/// A body that glows is never asked for its light, so what reflections find of it counts in full, by every strategy: a glowing
/// ball gives the light that a ball of light gives, beside a light that is asked, too.
#[test]
fn a_glowing_body_lights_as_a_light_does() {
    let glow = "
        sphere = [{ radius_m = 1.0, mass_kg = 1.0, material = 'b', position_m = [0, 0, 2] }]
        render.look.b = { bsdf = 'emitter', radiance = [5, 5, 5] }
    ";
    let beside = "render.light = [{ shape = 'sphere', position_m = [4, -1, 3], radius_m = 0.4, radiance = [5, 5, 5] }]";
    let of_ball = 0.7 * 5.0 / 4.0;
    let of_light = 0.7 * 5.0 * 0.16 / 26.0 * 3.0 / 26.0_f64.sqrt();
    for strategy in ["mis", "lights", "bsdf"] {
        let more = format!(
            "render.direct_light = '{strategy}'\nrender.samples_per_pixel = 64\nrender.sampler = 'independent'"
        );
        let settings = PLANE_AT_ORIGIN.replace("render.samples_per_pixel = 8", &more);
        let alone = format!("{glow}{settings}");
        check_mean(&format!("glowing ball, {strategy}"), &film(&scene(&alone)), of_ball);
        if strategy == "mis" {
            check_mean("beside a light", &film(&scene(&format!("{alone}{beside}"))), of_ball + of_light);
        }
    }
}

#[test]
fn plane_within_a_ball_light() {
    // From everywhere above comes the radiance 2; a point off the centre tests the sampling of directions.
    let light =
        "render.light = [{ shape = 'sphere', position_m = [2, 3, 1], radius_m = 9.0, radiance = [2, 2, 2] }]";
    check_mean("within a ball", &film(&scene(&format!("{PLANE_AT_ORIGIN}{light}"))), 0.7 * 2.0);
}

/// A light without size: intensity, cosine and distance alone, with no noise but what the pixel's width makes; a ball casts a sharp
/// shadow; and a small ball of the same intensity gives the same light.
#[test]
fn point_light_over_a_plane() {
    let light = "render.light = [{ shape = 'point', position_m = [1, 2, 2], intensity = [5, 5, 5] }]";
    let lit = film(&scene(&format!("{PLANE_AT_ORIGIN}{light}")));
    // d = 3, cos = 2/3.
    let expected = 0.7 / PI * 5.0 * (2.0 / 3.0) / 9.0;
    let worst = lit
        .rgb
        .iter()
        .map(|pixel| (pixel[0] / expected - 1.0).abs())
        .fold(0.0, |worst, off| if off > worst { off } else { worst });
    // The picture is 2.5e-5 wide from its middle, along x a quarter more, where the light changes by 1/3 of a shift, along y by
    // 2/3: 2.7e-5 in a corner.
    println!("point light: worst pixel off by {worst:.1e} of {expected:.6}, allowed 5e-5");
    assert!(worst < 5e-5, "{worst:e}");
    let ball = "sphere = [{ radius_m = 0.3, mass_kg = 1.0, material = 'a', position_m = [0.5, 1, 1] }]\n";
    let dark = film(&scene(&format!("{ball}{PLANE_AT_ORIGIN}{light}")));
    assert!(dark.rgb.iter().all(|pixel| *pixel == [0.0; 3]), "the ball stands in between");
    let radiance = 5.0 / (PI * 1e-4);
    let small = format!(
        "render.light = [{{ shape = 'sphere', position_m = [1, 2, 2], radius_m = 0.01, radiance = [{radiance:?}, {radiance:?}, {radiance:?}] }}]"
    );
    let small = mean_and_error(&film(&scene(&format!("{PLANE_AT_ORIGIN}{small}"))), 0).0;
    println!("a ball of 1 cm: {small:.6}");
    // Above the horizon a ball gives the light of its middle, whatever its radius.
    assert!((small / expected - 1.0).abs() < 1e-3, "{small} against {expected}");
    // No reflection finds it.
    let alone = format!("{PLANE_AT_ORIGIN}{light}\nrender.direct_light = 'bsdf'");
    assert!(film(&scene(&alone)).rgb.iter().all(|pixel| *pixel == [0.0; 3]));
}

#[test]
fn rectangle_light_over_a_plane() {
    let (corner, u, v) = (Vec3::new(-1.0, -0.5, 2.0), Vec3::new(0.0, 2.0, 0.5), Vec3::new(1.5, 0.0, 0.0));
    let light = "render.light = [{ shape = 'rectangle', corner_m = [-1, -0.5, 2], edge_u_m = [0, 2, 0.5], edge_v_m = [1.5, 0, 0], radiance = [4, 4, 4] }]";
    let expected = 0.7 / PI * 4.0 * irradiance_of_polygon(&[corner, corner + u, corner + u + v, corner + v]);
    check_mean("rectangle", &film(&scene(&format!("{PLANE_AT_ORIGIN}{light}"))), expected);
    // Turned over, it shines the other way.
    let back = "render.light = [{ shape = 'rectangle', corner_m = [-1, -0.5, 2], edge_u_m = [1.5, 0, 0], edge_v_m = [0, 2, 0.5], radiance = [4, 4, 4] }]";
    assert!(film(&scene(&format!("{PLANE_AT_ORIGIN}{back}"))).rgb.iter().all(|pixel| *pixel == [0.0; 3]));
}

#[test]
fn rectangle_light_half_below_the_plane() {
    let (a, b) = (Vec3::new(-2.0, -1.0, 0.0), Vec3::new(-2.0, 1.0, 0.0));
    let top = Vec3::new(0.0, 0.0, 1.5);
    let light = "render.light = [{ shape = 'rectangle', corner_m = [-2, -1, -1], edge_u_m = [0, 2, 0], edge_v_m = [0, 0, 2.5], radiance = [4, 4, 4] }]";
    let expected = 0.7 / PI * 4.0 * irradiance_of_polygon(&[a, b, b + top, a + top]);
    check_mean("half below", &film(&scene(&format!("{PLANE_AT_ORIGIN}{light}"))), expected);
}

#[test]
fn three_lights_add_up_and_one_hides_another() {
    // The second ball stands in front of the third as seen from the origin, so it takes that one's place.
    let light = "
        render.light = [
            { shape = 'sphere', position_m = [0, 2, 2], radius_m = 0.5, radiance = [3, 3, 3] },
            { shape = 'sphere', position_m = [-1.5, -1.5, 2], radius_m = 0.4, radiance = [6, 6, 6] },
            { shape = 'sphere', position_m = [-3, -3, 4], radius_m = 0.4, radiance = [60, 60, 60] },
        ]";
    let ball = |position: Vec3, radius: f64| {
        let squared = position.norm_squared();
        radius * radius / squared * position.z / squared.sqrt()
    };
    let expected =
        0.7 * (3.0 * ball(Vec3::new(0.0, 2.0, 2.0), 0.5) + 6.0 * ball(Vec3::new(-1.5, -1.5, 2.0), 0.4));
    check_mean("three lights", &film(&scene(&format!("{PLANE_AT_ORIGIN}{light}"))), expected);
}

#[test]
fn plane_under_the_sky() {
    // The cosine-weighted mean of the height is 2/3.
    let sky = PLANE_AT_ORIGIN.replace("zenith_radiance = [0, 0, 0]", "zenith_radiance = [2, 2, 2]").replace(
        "horizon_radiance = [0, 0, 0]",
        "horizon_radiance = [0.5, 0.5, 0.5]\nrender.sky.up = [0, 0, 3]",
    );
    for bounces in [0, 3] {
        let text = sky.replace("bounces_max = 0", &format!("bounces_max = {bounces}"));
        check_mean("under the sky", &film(&scene(&text)), 0.7 * (0.5 + 1.5 * 2.0 / 3.0));
    }
}

/// Within a white-grey ball of radius R with a ball light of radius r in its centre every wall point has the
/// irradiance pi L (r / R)^2 from the light, and the share (r / R)^2 of what a wall point reflects ends on the light.
/// So the wall's radiance is a geometric sum over the bounces, which tests light at every length of path.
#[test]
fn ball_light_within_a_ball() {
    for bounces in [0, 1, 2, 5] {
        let film = film(&scene(&format!(
            "
            sphere = [{{ radius_m = 2.0, mass_kg = 1.0, material = 'a', position_m = [0, 0, 0] }}]
            render.look.a.albedo = [0.8, 0.8, 0.8]
            render.light = [{{ shape = 'sphere', position_m = [0, 0, 0], radius_m = 0.6, radiance = [10, 10, 10] }}]
            render.camera = {{ position_m = [0, 0, 1.5], look_at_m = [3, 0, 1.5], vertical_field_of_view_rad = 0.5 }}
            render.width_px = 48
            render.height_px = 48
            render.bounces_max = {bounces}
            "
        )));
        let share = 0.3_f64 * 0.3;
        let (mut expected, mut term) = (0.0, 0.8 * 10.0 * share);
        for _ in 0..=bounces {
            expected += term;
            term *= 0.8 * (1.0 - share);
        }
        check_mean(&format!("{bounces} bounces"), &film, expected);
    }
}

#[test]
fn shadow_of_a_ring_on_a_plane() {
    // A ring whose wire hides the ball light from the origin, and one whose hole leaves it free.
    let light = "render.light = [{ shape = 'sphere', position_m = [0, 0, 10], radius_m = 0.5, radiance = [9, 9, 9] }]";
    let ring = |x: f64| {
        format!(
            "ring = [{{ major_radius_m = 3.0, minor_radius_m = 1.0, mass_kg = 1.0, material = 'b', position_m = [{x}, 0, 5] }}]\nrender.look.b.albedo = [0, 0, 0]\n"
        )
    };
    let text = |x: f64| format!("{}{PLANE_AT_ORIGIN}{light}", ring(x));
    assert!(film(&scene(&text(-3.0))).rgb.iter().all(|pixel| *pixel == [0.0; 3]));
    // The camera looks under the ring: it stands at (3, 0, 4), below the ring's lower side only near x = 0.
    let free = text(0.0).replace("position_m = [3, 0, 4]", "position_m = [1, 0, 2]");
    check_mean("through the hole", &film(&scene(&free)), 0.7 * 9.0 * 0.25 / 100.0);
}
