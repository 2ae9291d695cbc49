//! What surfaces do to a laser pulse, and which surface a point of an object has.

use nalgebra::{Point3, Vector3};

/// What a surface is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Material {
    Paint,
    /// Paint that absorbs nearly all of the pulse.
    BlackPaint,
    /// A vehicle's window: most beams pass.
    Glass,
    /// A building's window: most beams are lost, none pass.
    Pane,
    /// Number plates, lamps, traffic signs.
    Retroreflector,
    Rubber,
    Upholstery,
    Cloth,
    Skin,
    Metal,
    /// The spokes of a bicycle: most beams pass.
    Spokes,
    /// A wire fence: many beams pass.
    Mesh,
    Masonry,
    Bark,
    /// Foliage: a beam goes some way into it before it comes back.
    Leaves,
    Asphalt,
    Paving,
    Grass,
    /// Drops in the air and mirroring puddles.
    Water,
}

/// A material's answer to a pulse.
#[derive(Debug, Clone, Copy)]
pub(super) struct Optics {
    /// Share of the pulse that is scattered back, 0 to 1.
    pub reflectivity: f64,
    /// Share of pulses that pass through the surface.
    pub transmission: f64,
    /// Share of the others that never come back, whatever their range.
    pub loss: f64,
}

impl Material {
    /// Mean depth in metres that a beam reaches within foliage.
    pub const FOLIAGE_DEPTH: f64 = 0.9;

    pub fn optics(self) -> Optics {
        let (reflectivity, transmission, loss) = match self {
            Material::Paint => (0.45, 0.0, 0.03),
            Material::BlackPaint => (0.04, 0.0, 0.87),
            Material::Glass => (0.08, 0.65, 0.6),
            Material::Pane => (0.10, 0.0, 0.75),
            Material::Retroreflector => (1.0, 0.0, 0.0),
            Material::Rubber => (0.08, 0.0, 0.05),
            Material::Upholstery => (0.20, 0.0, 0.0),
            Material::Cloth => (0.35, 0.0, 0.0),
            Material::Skin => (0.45, 0.0, 0.0),
            Material::Metal => (0.40, 0.0, 0.03),
            Material::Spokes => (0.30, 0.85, 0.0),
            Material::Mesh => (0.35, 0.55, 0.0),
            Material::Masonry => (0.40, 0.0, 0.0),
            Material::Bark => (0.35, 0.0, 0.0),
            Material::Leaves => (0.40, 0.0, 0.05),
            Material::Asphalt => (0.24, 0.0, 0.0),
            Material::Paving => (0.32, 0.0, 0.0),
            Material::Grass => (0.45, 0.0, 0.02),
            Material::Water => (0.15, 0.0, 0.0),
        };
        Optics { reflectivity, transmission, loss }
    }
}

/// Which material a part shows where. Positions and normals are in the object's frame.
#[derive(Debug, Clone)]
pub(super) enum Coating {
    Plain(Material),
    /// A vehicle's lower body with lamps at the corners and a number plate at either end.
    Bodywork {
        paint: Material,
        half_length: f64,
        half_width: f64,
    },
    /// A vehicle's cabin.
    Cabin(Glazing),
    /// A bicycle's wheel in the plane y = const.
    SpokedWheel {
        x: f64,
        z: f64,
        rim: f64,
    },
    /// A wall with windows, three metres to a floor and two to a window.
    Facade,
}

/// The windows of a cabin.
#[derive(Debug, Clone)]
pub(super) struct Glazing {
    pub paint: Material,
    /// Lower edge of the windows, metres.
    pub sill: f64,
    /// Upper edge of the windows, metres.
    pub header: f64,
    /// Half width of windscreen and rear window, metres.
    pub half_width: f64,
    /// Where the side windows end at the back and at the front, at the height of the sill.
    pub sides: [f64; 2],
    /// How far the front end of the side windows moves back for each metre of height.
    pub rake: f64,
    /// Where the pillar between the side windows stands.
    pub pillar: f64,
    /// Whether there is a window at the back.
    pub rear: bool,
}

impl Coating {
    /// The material at a point of the surface.
    pub fn material_at(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> Material {
        match self {
            Coating::Plain(material) => *material,
            Coating::Bodywork { paint, half_length, half_width } => {
                bodywork(*paint, *half_length, *half_width, point)
            }
            Coating::Cabin(glazing) if glazing.is_window(point, normal) => Material::Glass,
            Coating::Cabin(glazing) => glazing.paint,
            Coating::SpokedWheel { x, z, rim } => {
                if (point.x - x).hypot(point.z - z) < *rim {
                    Material::Spokes
                } else {
                    Material::Rubber
                }
            }
            Coating::Facade => facade(point, normal),
        }
    }

    /// Whether the inner side of the surface is seen by a beam that has passed the outer one.
    pub fn is_shell(&self) -> bool {
        matches!(self, Coating::Cabin(_))
    }

    /// Whether beams come back from within.
    pub fn is_foliage(&self) -> bool {
        matches!(self, Coating::Plain(Material::Leaves))
    }
}

fn bodywork(paint: Material, half_length: f64, half_width: f64, at: &Point3<f64>) -> Material {
    let is_end = at.x.abs() > half_length - 0.25;
    let aside = at.y.abs();
    let is_plate = aside < 0.26 && (0.38..0.52).contains(&at.z);
    let is_lamp = aside > half_width - 0.38 && (0.60..0.74).contains(&at.z);
    if is_end && (is_plate || is_lamp) { Material::Retroreflector } else { paint }
}

fn facade(at: &Point3<f64>, normal: &Vector3<f64>) -> Material {
    let (floor, bay) = (at.z.rem_euclid(3.0), at.x.rem_euclid(2.4));
    let is_window = (1.0..2.4).contains(&floor) && (0.6..1.8).contains(&bay);
    if is_window && at.z > 0.0 && normal.y.abs() > 0.5 { Material::Pane } else { Material::Masonry }
}

impl Glazing {
    fn is_window(&self, at: &Point3<f64>, normal: &Vector3<f64>) -> bool {
        if !(self.sill..self.header).contains(&at.z) {
            return false;
        }
        if normal.y.abs() > 0.6 {
            let front = self.sides[1] - self.rake * (at.z - self.sill);
            return at.x > self.sides[0] && at.x < front && (at.x - self.pillar).abs() > 0.06;
        }
        let is_screen = normal.x > 0.2 || (self.rear && normal.x < -0.2);
        is_screen && at.y.abs() < self.half_width
    }
}
