//! What a weave's numbers must be, and how a refusal says it.

use super::japanese::Japanese;
use super::{Pattern, Weave};
use crate::scene::SceneError;
use crate::scene::materials::drag;
use crate::scene::validate::{positive, radii, refuse, refuse_number, vector};

impl Weave {
    /// Checks every value but the names; `key` makes a field's path.
    pub(in crate::scene) fn validate(&self, key: &dyn Fn(&str) -> String) -> Result<(), SceneError> {
        radii(key, self.major_radius_m, self.minor_radius_m)?;
        positive(&key("ring_mass_kg"), self.ring_mass_kg)?;
        vector(&key("position_m"), &self.position_m)?;
        vector(&key("rotation_rad"), &self.rotation_rad)?;
        drag(key, self.drag.as_ref())?;
        for pin in &self.pins {
            if pin[0] >= self.rows || pin[1] >= self.columns {
                let expected = format!("[row, column] below [{}, {}]", self.rows, self.columns);
                return Err(refuse(&key("pins"), format!("{pin:?}"), &expected));
            }
        }
        if let Some(row) = self.pin_rows.iter().find(|&&row| row >= self.rows) {
            return Err(refuse(&key("pin_rows"), row, &format!("rows below {}", self.rows)));
        }
        self.validate_grips(key)?;
        if !(self.remove_share >= 0.0 && self.remove_share < 1.0) {
            return Err(refuse_number(&key("remove_share"), self.remove_share, "0 or more, and less than 1"));
        }
        match self.pattern {
            Pattern::European4In1 => self.wire_below(key, 0.25),
            Pattern::European6In1 => self.wire_below(key, 0.185),
            Pattern::Chain => self.wire_below(key, 0.3125),
            Pattern::Japanese8In2 | Pattern::Japanese12In2 => return self.validate_japanese(key),
        }?;
        let connector = [
            ("connector_major_radius_m", self.connector_major_radius_m),
            ("connector_minor_radius_m", self.connector_minor_radius_m),
            ("connector_mass_kg", self.connector_mass_kg),
        ];
        match connector.into_iter().find_map(|(field, given)| Some((field, given?))) {
            Some((field, given)) => {
                let expected = format!("no such key: {} has no connectors", self.pattern.name());
                Err(refuse_number(&key(field), given, &expected))
            }
            None => Ok(()),
        }
    }

    /// Grips are in the patch, and no ring is held twice.
    fn validate_grips(&self, key: &dyn Fn(&str) -> String) -> Result<(), SceneError> {
        let (rows, columns) = (self.rows, self.columns);
        for (index, grip) in self.grips.iter().enumerate() {
            let key = |field: &str| key(&format!("grip[{index}].{field}"));
            if let Some(row) = grip.rows.iter().find(|&&row| row >= rows) {
                return Err(refuse(&key("rows"), row, &format!("rows below {rows}")));
            }
            if let Some(column) = grip.columns.iter().find(|&&column| column >= columns) {
                return Err(refuse(&key("columns"), column, &format!("columns below {columns}")));
            }
            if let Some(ring) = grip.rings.iter().find(|ring| ring[0] >= rows || ring[1] >= columns) {
                let expected = format!("[row, column] below [{rows}, {columns}]");
                return Err(refuse(&key("rings"), format!("{ring:?}"), &expected));
            }
        }
        if self.grips.is_empty() {
            return Ok(());
        }
        let pins = self.sorted_pins();
        for place in (0..rows).flat_map(|row| (0..columns).map(move |column| [row, column])) {
            let holders = self.grips.iter().filter(|grip| grip.holds(place)).count();
            if holders + usize::from(self.is_pinned(&pins, place)) > 1 {
                let expected = "each ring pinned or gripped once";
                return Err(refuse(&key("grip"), format!("ring {place:?} held more than once"), expected));
            }
        }
        Ok(())
    }

    fn wire_below(&self, key: &dyn Fn(&str) -> String, ratio: f64) -> Result<(), SceneError> {
        let largest = ratio * self.major_radius_m;
        if self.minor_radius_m < largest {
            return Ok(());
        }
        let expected = format!(
            "less than {largest:?}: {} has room for wires thinner than {ratio} major radii",
            self.pattern.name()
        );
        Err(refuse_number(&key("minor_radius_m"), self.minor_radius_m, &expected))
    }

    fn validate_japanese(&self, key: &dyn Fn(&str) -> String) -> Result<(), SceneError> {
        let optional = [
            ("connector_major_radius_m", self.connector_major_radius_m),
            ("connector_minor_radius_m", self.connector_minor_radius_m),
            ("connector_mass_kg", self.connector_mass_kg),
        ];
        for (field, given) in optional {
            given.map_or(Ok(()), |given| positive(&key(field), given))?;
        }
        let (Some(grid), Some(layout)) = (self.pattern.grid(), self.japanese()) else { return Ok(()) };
        let name = self.pattern.name();
        let wire = self.connector_minor_radius_m.unwrap_or(self.minor_radius_m);
        let wire_max = layout.connector_wire_max();
        if wire > wire_max * (1.0 + 1e-12) {
            let ratio = Japanese::ratio_max(grid);
            return Err(match self.connector_minor_radius_m {
                None => refuse_number(
                    &key("minor_radius_m"),
                    self.minor_radius_m,
                    &format!(
                        "at most {:?}: {name} has room for {ratio:.4} major radii with connectors of the same wire; \
                         connector_minor_radius_m makes them thinner",
                        ratio * self.major_radius_m
                    ),
                ),
                Some(given) => refuse_number(
                    &key("connector_minor_radius_m"),
                    given,
                    &format!(
                        "at most {wire_max:?}: {name} has no room for thicker connectors in these rings"
                    ),
                ),
            });
        }
        let (least, largest) = layout.connector_range();
        match self.connector_major_radius_m {
            Some(given) if given < least || given > largest || given <= wire => {
                let expected =
                    format!("from {least:?} to {largest:?}: what {name} has room for with these wires");
                Err(refuse_number(&key("connector_major_radius_m"), given, &expected))
            }
            _ => Ok(()),
        }
    }
}
