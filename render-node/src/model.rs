//! The second half of a scene, compiled: everything that no frame changes.

use crate::bsdf::Bsdf;
use crate::environment::EnvironmentMap;
use crate::light::{AreaLight, Environment, PointLight, Sun};
use crate::solids::{FormulaRefused, SolidFrame, SolidShape};
use geometry::Vec3;
use schemas::plan::Plan;
use schemas::scene::Scene;
use schemas::scene::render::{self, Render, RootFinder, UNLIMITED};

/// What a scene looks like apart from the poses of its bodies. Immutable.
#[derive(Clone, Debug)]
pub struct RenderModel {
    /// The settings it was compiled from.
    pub(crate) render: Render,
    /// How often frames are taken (1/s).
    frames_per_second: f64,
    pub(crate) rings: Vec<RingShape>,
    pub(crate) spheres: Vec<SphereShape>,
    /// Capsules, boxes, polynomial bodies and then surfaces that are only looked at, with their looks. By the companion
    /// matrix rings and spheres are the first of them, and `rings` and `spheres` are empty.
    pub(crate) solids: Vec<(SolidShape, u32)>,
    /// Where the surfaces that are only looked at are: the last of the solids.
    pub(crate) sheets: Vec<SolidFrame>,
    pub(crate) planes: Vec<PlaneShape>,
    pub(crate) lights: Vec<AreaLight>,
    pub(crate) suns: Vec<Sun>,
    pub(crate) point_lights: Vec<PointLight>,
    pub(crate) environment: Option<Environment>,
    /// The lights that shine: each is asked for its light equally often.
    pub(crate) shining: Vec<Shining>,
    pub(crate) sky: Sky,
    pub(crate) looks: Vec<CompiledLook>,
    pub(crate) features: Features,
}

/// Parts of the light transport that a scene may do without.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Features {
    /// The last vertex of a path asks whether it sees the sky, a sun or the environment.
    pub sky: bool,
    /// Vertices are lit by lights.
    pub lights: bool,
    /// Bodies or planes glow.
    pub emitters: bool,
    /// Rays meet bodies.
    pub bodies: bool,
}

/// A light that can be asked for its light, by its number among those of its kind.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shining {
    Area(usize),
    Sun(usize),
    Point(usize),
    Environment,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct RingShape {
    pub major_radius: f64,
    pub minor_radius: f64,
    pub look: u32,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct SphereShape {
    pub radius: f64,
    pub look: u32,
}

#[derive(Clone, Debug)]
pub(crate) struct PlaneShape {
    pub normal: Vec3,
    pub offset: f64,
    /// Two axes within the plane, along which the squares of a checkerboard lie.
    pub axes: [Vec3; 2],
    pub look: u32,
}

/// How a material scatters light, on each colour of square, and what it emits.
#[derive(Clone, Debug)]
pub(crate) struct CompiledLook {
    pub bsdf: Bsdf,
    pub checker: Option<Bsdf>,
    pub emitted: Option<Vec3>,
}

#[derive(Clone, Debug)]
pub(crate) struct Sky {
    up: Vec3,
    horizon: Vec3,
    rise: Vec3,
}

impl Sky {
    /// Radiance from a direction: the horizon's at and below it, from there linear in the height to the zenith.
    #[inline]
    pub(crate) fn radiance(&self, direction: &Vec3) -> Vec3 {
        let height = direction.dot(&self.up);
        if height > 0.0 { self.horizon + self.rise * height } else { self.horizon }
    }
}

impl RenderModel {
    /// Compiles a resolved scene, and says what its pictures need and what is left out.
    ///
    /// # Panics
    ///
    /// If the scene still has weaves: [`Scene::parse`] lays them out. If a polynomial's formula is not that of a body:
    /// see [`RenderModel::try_compile`].
    pub fn compile(scene: &Scene) -> (RenderModel, Plan) {
        Self::try_compile(scene).unwrap_or_else(|error| panic!("{error}"))
    }

    /// The same for a scene that no simulator has accepted.
    ///
    /// # Errors
    ///
    /// [`FormulaRefused`] if a polynomial's formula is not that of a body, or a surface's shows nothing.
    ///
    /// # Panics
    ///
    /// If the scene still has weaves.
    pub fn try_compile(scene: &Scene) -> Result<(RenderModel, Plan), FormulaRefused> {
        Self::compile_with(scene, false)
    }

    /// The same with nothing left out: slower, and the same bits. For tests.
    pub fn compile_with_everything(scene: &Scene) -> RenderModel {
        Self::compile_with(scene, true).unwrap_or_else(|error| panic!("{error}")).0
    }

    fn compile_with(scene: &Scene, everything: bool) -> Result<(RenderModel, Plan), FormulaRefused> {
        assert!(scene.weaves.is_empty(), "{} weaves are not laid out: use Scene::parse", scene.weaves.len());
        let render = &scene.render;
        let mut looks = Looks::new(render);
        let companion = render.root_finder == RootFinder::Companion;
        let round = if companion { SolidShape::round(scene) } else { Vec::new() };
        let rings = scene.rings.iter().filter(|_| !companion).map(|ring| RingShape {
            major_radius: ring.major_radius_m,
            minor_radius: ring.minor_radius_m,
            look: looks.of_material(&ring.material),
        });
        let rings = rings.collect::<Vec<_>>();
        let spheres = scene.spheres.iter().filter(|_| !companion);
        let spheres = spheres
            .map(|sphere| SphereShape { radius: sphere.radius_m, look: looks.of_material(&sphere.material) });
        let spheres = spheres.collect::<Vec<_>>();
        let solids = round.into_iter().chain(SolidShape::of(scene)?);
        let mut solids =
            solids.map(|(shape, material)| (shape, looks.of_material(material))).collect::<Vec<_>>();
        let mut sheets = Vec::new();
        for (shape, look, frame) in SolidShape::sheets(scene)? {
            solids.push((shape, looks.of_material(look)));
            sheets.push(frame);
        }
        let planes = scene.planes.iter().map(|plane| {
            let normal = Vec3::from(plane.normal);
            let look = looks.of_material(&plane.material);
            PlaneShape { normal, offset: plane.offset_m, axes: checker_axes(&normal), look }
        });
        let planes = planes.collect::<Vec<_>>();
        let lights: Vec<_> = render.lights.iter().filter_map(AreaLight::new).collect();
        let suns: Vec<_> = render.lights.iter().filter_map(Sun::new).collect();
        let lit = (0..lights.len()).filter(|&index| lights[index].is_lit()).map(Shining::Area);
        let up = (0..suns.len()).filter(|&index| suns[index].radiance != Vec3::zeros()).map(Shining::Sun);
        let point_lights: Vec<_> = render.lights.iter().filter_map(PointLight::new).collect();
        let points = (0..point_lights.len())
            .filter(|&index| point_lights[index].intensity != Vec3::zeros())
            .map(Shining::Point);
        let counts = [lit.clone().count(), up.clone().count(), points.clone().count()];
        let shining: Vec<_> = lit.chain(up).chain(points).collect();
        let plan = plan(scene, counts);
        let horizon = Vec3::from(render.sky.horizon_radiance);
        let model = RenderModel {
            frames_per_second: scene.time.frames_per_second,
            sky: Sky {
                up: Vec3::from(render.sky.up).normalize(),
                horizon,
                rise: Vec3::from(render.sky.zenith_radiance) - horizon,
            },
            features: Features {
                sky: everything
                    || ["sky", "sun", "environment"].iter().any(|name| plan.needs(&format!("light/{name}"))),
                lights: everything
                    || ["area", "sun", "point", "environment"]
                        .iter()
                        .any(|name| plan.needs(&format!("light/{name}"))),
                emitters: everything || plan.needs("look/emitter"),
                bodies: everything
                    || ["ring", "sphere", "capsule", "box", "polynomial", "surface"]
                        .iter()
                        .any(|name| plan.needs(&format!("shape/{name}"))),
            },
            render: render.clone(),
            rings,
            spheres,
            solids,
            sheets,
            planes,
            lights,
            suns,
            point_lights,
            environment: None,
            shining,
            looks: looks.compiled,
        };
        Ok((model, plan))
    }

    /// The same model with the picture that the scene's `render.environment` names.
    ///
    /// # Panics
    ///
    /// If the scene names none.
    pub fn with_environment(mut self, map: EnvironmentMap) -> RenderModel {
        let settings = self.render.environment.as_ref().expect("the scene has a render.environment");
        let up = Vec3::from(self.render.sky.up).normalize();
        self.environment = Some(Environment::new(settings, up, checker_axes(&up), map));
        self.shining.push(Shining::Environment);
        self
    }

    /// The settings of the picture.
    pub fn settings(&self) -> &Render {
        &self.render
    }

    /// Simulated time of a frame (s).
    pub(crate) fn frame_time(&self, frame: u64) -> f64 {
        frame as f64 / self.frames_per_second
    }

    /// The part of the picture that is rendered: left, top, width and height in pixels.
    pub(crate) fn part(&self) -> (u32, u32, u32, u32) {
        let [left, top, width, height] =
            self.render.crop_px.unwrap_or([0, 0, self.render.width_px, self.render.height_px]);
        (left, top, width, height)
    }

    /// Number of moving bodies: all but planes and surfaces that are only looked at.
    pub fn body_count(&self) -> usize {
        self.rings.len() + self.spheres.len() + self.solids.len() - self.sheets.len()
    }

    /// A ray does not meet a surface nearer to its origin than this, in metres, so that it does not meet the
    /// one that it leaves again.
    ///
    /// Hits of surfaces are exact to about 1e-13 of their size, so 1e-6 of the thinnest wire is far above what
    /// rounding can do and far below what a picture can show.
    pub(crate) fn ray_start(&self) -> f64 {
        let radii = self.rings.iter().map(|ring| ring.minor_radius);
        let radii = radii.chain(self.spheres.iter().map(|sphere| sphere.radius));
        let radii = radii.chain(self.solids.iter().map(|(shape, _)| shape.detail()));
        let least = radii.reduce(|least, radius| if radius < least { radius } else { least });
        1e-6 * least.unwrap_or(1.0)
    }
}

/// Looks by material name; each is compiled once.
struct Looks<'a> {
    render: &'a Render,
    names: Vec<String>,
    compiled: Vec<CompiledLook>,
}

impl<'a> Looks<'a> {
    fn new(render: &'a Render) -> Looks<'a> {
        Looks { render, names: Vec::new(), compiled: Vec::new() }
    }

    fn of_material(&mut self, name: &str) -> u32 {
        if let Some(index) = self.names.iter().position(|known| known == name) {
            return index as u32;
        }
        let look = self.render.looks.get(name).cloned().unwrap_or_default();
        self.names.push(name.to_owned());
        self.compiled.push(CompiledLook {
            bsdf: Bsdf::new(&look, look.albedo),
            checker: look.checker_albedo.map(|albedo| Bsdf::new(&look, albedo)),
            emitted: (look.bsdf == render::Bsdf::Emitter)
                .then(|| Vec3::from(look.radiance.unwrap_or_default())),
        });
        (self.compiled.len() - 1) as u32
    }
}

/// The two World axes least along the normal, made perpendicular to it and to each other.
fn checker_axes(normal: &Vec3) -> [Vec3; 2] {
    let least =
        (0..3).fold(0, |best, axis| if normal[axis].abs() < normal[best].abs() { axis } else { best });
    let mut along = Vec3::zeros();
    along[least] = 1.0;
    let first = (along - normal * normal.dot(&along)).normalize();
    [first, normal.cross(&first)]
}

/// The numbers of lights are those that shine: area lights, suns and points.
fn plan(scene: &Scene, [lit, suns, points]: [usize; 3]) -> Plan {
    let render = &scene.render;
    let mut plan = Plan::default();
    let counted = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    plan.push("shape/ring", !scene.rings.is_empty(), counted(scene.rings.len(), "ring"));
    plan.push("shape/sphere", !scene.spheres.is_empty(), counted(scene.spheres.len(), "sphere"));
    plan.push("shape/plane", !scene.planes.is_empty(), counted(scene.planes.len(), "plane"));
    // Shapes that few scenes have are told of where they are.
    let others = [
        ("capsule", scene.capsules.len(), "capsule"),
        ("box", scene.boxes.len(), "solid box"),
        ("polynomial", scene.polynomials.len(), "polynomial"),
        ("surface", render.surfaces.len(), "surface"),
    ];
    for (name, count, what) in others {
        if count > 0 {
            let reason = if name == "box" && count > 1 {
                format!("{count} solid boxes")
            } else {
                counted(count, what)
            };
            plan.push(&format!("shape/{name}"), true, reason);
        }
    }
    if render.root_finder == RootFinder::Companion {
        plan.push("shape/companion", true, "root_finder is \"companion\": to compare, and slow");
    }
    plan.push(
        "light/area",
        lit > 0,
        format!("{} that shine{}", counted(lit, "light"), if lit == 1 { "s" } else { "" }),
    );
    if suns > 0 {
        plan.push("light/sun", true, counted(suns, "sun"));
    }
    if points > 0 {
        plan.push("light/point", true, counted(points, "light") + " without size");
    }
    let sky = render.sky.zenith_radiance != [0.0; 3] || render.sky.horizon_radiance != [0.0; 3];
    if let Some(environment) = &render.environment {
        plan.push("light/environment", true, format!("the map {}", environment.file));
        plan.push("light/sky", false, "the environment map takes its place");
    } else {
        let reason = if sky { "its radiance is not zero" } else { "zenith and horizon are black" };
        plan.push("light/sky", sky, reason);
    }
    let bounces = render.bounces_max;
    let reason = match bounces {
        UNLIMITED => "bounces_max is unlimited".to_owned(),
        _ => format!("bounces_max is {bounces}"),
    };
    plan.push("light/indirect", bounces > 0, reason);
    // What few scenes have is told of where it is.
    if bounces > render.roulette_after {
        let reason = format!("bounces_max is more than roulette_after, which is {}", render.roulette_after);
        plan.push("light/roulette", true, reason);
    }
    if let Some(most) = render.indirect_max {
        plan.push("light/cut", true, format!("indirect_max is {most:?}: the mean is not that of all light"));
    }
    if render.camera.lens_radius_m > 0.0 {
        plan.push("camera/lens", true, format!("lens_radius_m is {:?}", render.camera.lens_radius_m));
    }
    if render.camera.shutter_s > 0.0 {
        let (moments, seconds) = (render.camera.shutter_moments, render.camera.shutter_s);
        plan.push("camera/shutter", true, format!("{moments} moments of {seconds:?} s"));
    }
    for bsdf in [render::Bsdf::Conductor, render::Bsdf::Plastic, render::Bsdf::Mirror, render::Bsdf::Emitter]
    {
        let named = |material: &&String| render.looks.get(*material).is_some_and(|look| look.bsdf == bsdf);
        if let Some(material) = materials(scene).find(named) {
            plan.push(&format!("look/{}", bsdf.name()), true, format!("the look of {material}"));
        }
    }
    let checkered = scene
        .planes
        .iter()
        .any(|plane| render.looks.get(&plane.material).is_some_and(|look| look.checker_albedo.is_some()));
    let reason = if checkered { "a plane's look has a checker_albedo" } else { "no plane's look has one" };
    plan.push("look/checkerboard", checkered, reason);
    plan
}

/// The materials of all bodies and planes.
fn materials(scene: &Scene) -> impl Iterator<Item = &String> {
    let rings = scene.rings.iter().map(|ring| &ring.material);
    let rings = rings.chain(scene.spheres.iter().map(|sphere| &sphere.material));
    let rings = rings.chain(scene.capsules.iter().map(|capsule| &capsule.material));
    let rings = rings.chain(scene.boxes.iter().map(|cuboid| &cuboid.material));
    let rings = rings.chain(scene.polynomials.iter().map(|polynomial| &polynomial.material));
    rings.chain(scene.planes.iter().map(|plane| &plane.material))
}
