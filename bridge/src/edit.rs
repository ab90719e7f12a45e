//! Changes of the building as they come over the network (`docs/off-board.md`, *Editing the building*): read, checked against
//! the vehicle, made into files. Pure.

use crate::roles::Role;
use floorplan::{DistanceField, Plan, PlanHeader, Rooms, Sidecar};
use serde::Deserialize;

/// Longest JSON of a change, bytes.
pub const MAX_EDIT: usize = 262_144;
/// Largest picture of a plan, bytes: a building of 100 m by 100 m in cells of 5 cm takes a tenth.
pub const MAX_PICTURE: usize = 1_048_576;
/// Finest and coarsest cell of a plan that is sent, metres: what `plan.resolution` of a file may be, too.
const RESOLUTION_M: std::ops::RangeInclusive<f64> = 0.01..=0.5;
/// Longest name of who makes a change, bytes: an e-mail address.
pub const LONGEST_ACCOUNT: usize = 254;
/// How far from the pad walls are looked for, metres.
const CLEARANCE_M: f32 = 2.0;

/// The JSON of a change.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EditText {
    /// 16 hexadecimal digits drawn at random.
    pub id: String,
    /// The newest beacon that its sender has seen.
    pub beacon_ns: u64,
    /// Who makes it; the certificate itself when absent.
    #[serde(default)]
    pub account: String,
    /// Role of the account; that of the certificate when absent.
    #[serde(default)]
    pub role: String,
    /// `revision` of `about`, from which the change was made.
    pub made_from: String,
    /// The side file as it is to be.
    pub building: Sidecar,
    /// A new plan, whose picture comes beside; absent when the plan stays.
    #[serde(default)]
    pub plan: Option<PlanText>,
}

/// Where the picture of a new plan lies.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanText {
    /// Side of a cell, metres.
    pub resolution_m: f64,
    /// Lower left corner of the picture in the plan frame, metres.
    pub origin_x_m: f64,
    /// Lower left corner of the picture in the plan frame, metres.
    pub origin_y_m: f64,
}

/// A change that was understood, with who makes it.
#[derive(Debug, Clone)]
pub struct Edit {
    /// Drawn at random by its sender.
    pub id: u64,
    /// The newest beacon that its sender has seen.
    pub beacon_ns: u64,
    /// Role of the account, if it has one.
    pub role: Option<Role>,
    /// Who makes it, as it is logged; empty for the certificate itself.
    pub account: String,
    /// `revision` of the building from which it was made.
    pub made_from: String,
    building: Sidecar,
    plan: Option<(PlanText, Vec<u8>)>,
}

/// What is there now.
#[derive(Debug)]
pub struct Present<'a> {
    /// The plan, whose header and picture stay unless the change brings another.
    pub plan: &'a Plan,
    /// Name of the header's file, as the manifest says.
    pub name: &'a str,
    /// Radius of the vehicle, metres.
    pub radius_m: f32,
}

/// Files to be written. Names are relative to the directory of the plan's header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Files {
    /// The side file.
    pub sidecar: String,
    /// Header, name and bytes of the picture of a new plan.
    pub plan: Option<(String, String, Vec<u8>)>,
}

impl Edit {
    /// Reads a change and the picture beside it.
    ///
    /// # Errors
    /// One sentence that names field, value and what is allowed.
    pub fn parse(json: &[u8], picture: Option<&[u8]>) -> Result<Self, String> {
        let text: EditText = serde_json::from_slice(json).map_err(|error| {
            format!("not the JSON of a change: {}", manifest::one_line(&error.to_string()))
        })?;
        let id = crate::order::identity(&text.id)?;
        let role = crate::order::claimed_role(&text.role)?;
        if text.account.len() > LONGEST_ACCOUNT || text.account.chars().any(char::is_control) {
            return Err(format!("account: at most {LONGEST_ACCOUNT} bytes of text"));
        }
        if text.made_from.len() != 16 || !text.made_from.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            let given: String = text.made_from.chars().take(20).collect();
            return Err(format!(
                "made_from = {}: allowed are the 16 hexadecimal digits of `revision` in about",
                manifest::plain(&given)
            ));
        }
        let building = text.building.checked("building").map_err(|error| error.to_string())?;
        let plan = match (text.plan, picture) {
            (None, None) => None,
            (Some(plan), Some(picture)) => Some((plan, picture.to_vec())),
            (Some(_), None) => return Err("plan: its picture is missing beside it".to_owned()),
            (None, Some(_)) => return Err("there is a picture and no plan for it".to_owned()),
        };
        Ok(Self {
            id,
            beacon_ns: text.beacon_ns,
            role,
            account: text.account,
            made_from: text.made_from,
            building,
            plan,
        })
    }

    /// One sentence on what is changed.
    #[must_use]
    pub fn what(&self) -> &'static str {
        if self.plan.is_some() { "a new plan" } else { "round and zones" }
    }

    /// Checks the change as the services will, and makes the files. Decodes a picture: takes up to a second.
    ///
    /// # Errors
    /// One sentence that names what is wrong.
    pub fn files(&self, present: &Present<'_>) -> Result<Files, String> {
        let said = |error: floorplan::PlanError| error.to_string();
        let stem = stem(present.name);
        let (loaded, plan) = match &self.plan {
            None => (None, None),
            Some((place, picture)) => {
                if !RESOLUTION_M.contains(&place.resolution_m) {
                    return Err(format!(
                        "plan.resolution_m = {}: allowed is 0.01 to 0.5 m",
                        place.resolution_m
                    ));
                }
                // Under a name of its own, so that header and picture never belong to different plans.
                let file = format!("{stem}.{:016x}.png", runtime::fnv(picture));
                let header = format!(
                    "# Sent over the network.\nimage: {file}\nresolution: {}\norigin: [{}, {}, 0.0]\nnegate: 0\n\
                     occupied_thresh: 0.65\nfree_thresh: 0.196\n",
                    place.resolution_m, place.origin_x_m, place.origin_y_m
                );
                let parsed = PlanHeader::parse("plan", header.as_bytes()).map_err(said)?;
                let loaded = Plan::load("plan", &parsed, picture).map_err(said)?;
                (Some(loaded), Some((header, file, picture.clone())))
            }
        };
        let ground = loaded.as_ref().unwrap_or(present.plan);
        Rooms::of("building", &self.building, ground).map_err(said)?;
        let Some(pad) = self.building.pad else {
            return Err("building: `pad` is missing: where the drone starts and lands".to_owned());
        };
        let field = DistanceField::of_not_free(ground, CLEARANCE_M);
        ground.check_pad(&field, pad.x, pad.y, present.radius_m).map_err(said)?;
        Ok(Files { sidecar: self.building.yaml("building").map_err(said)?, plan })
    }
}

/// The name of a header without its ending.
#[must_use]
pub fn stem(name: &str) -> &str {
    let file = name.rsplit('/').next().unwrap_or(name);
    file.strip_suffix(".yaml").or_else(|| file.strip_suffix(".yml")).unwrap_or(file)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    const ROOM: [&str; 8] = [
        "####################",
        "#..................#",
        "#..................#",
        "#..................#",
        "#..................#",
        "#..................#",
        "#..................#",
        "####################",
    ];

    fn change(building: &Value, plan: &Value) -> Vec<u8> {
        json!({ "id": "00000000000000aa", "beacon_ns": 7, "made_from": "00000000000000bb",
            "building": building, "plan": plan })
        .to_string()
        .into_bytes()
    }

    fn files(building: &Value) -> Result<Files, String> {
        let plan = Plan::from_ascii(&ROOM, 0.2);
        let present = Present { plan: &plan, name: "plans/demo.yaml", radius_m: 0.25 };
        Edit::parse(&change(building, &Value::Null), None)?.files(&present)
    }

    fn picture(side: u32) -> Vec<u8> {
        let drawn = image::GrayImage::from_fn(side, side, |x, y| {
            let wall = x == 0 || y == 0 || x + 1 == side || y + 1 == side;
            image::Luma([if wall { 0 } else { 254 }])
        });
        let mut png = Vec::new();
        drawn.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
        png
    }

    #[test]
    fn a_round_becomes_the_side_file_that_the_services_read() {
        let building = json!({
            "pad": { "x": 1.0, "y": 0.8 }, "rooms": [{ "name": "Hall", "rectangle": [0.2, 0.2, 3.8, 1.4] }],
            "round": { "order": ["Hall"], "points": [{ "name": "Safe", "x": 3.0, "y": 0.8 }] },
            "privacy": [{ "name": "Desk", "polygon": [[2, 1], [3, 1], [3, 1.2]] }],
        });
        let files = files(&building).unwrap();
        assert_eq!(files.plan, None);
        let read = Sidecar::parse("a", files.sidecar.as_bytes()).unwrap();
        assert_eq!((read.round.points[0].name.as_str(), read.privacy[0].name.as_str()), ("Safe", "Desk"));
    }

    #[test]
    fn what_no_drone_could_fly_is_refused_by_name() {
        let room = json!([{ "name": "Hall", "rectangle": [0.2, 0.2, 3.8, 1.4] }]);
        for (building, said) in [
            (json!({ "rooms": room }), "`pad` is missing"),
            (json!({ "pad": { "x": 0.1, "y": 0.8 } }), "inside a wall"),
            (json!({ "pad": { "x": 0.35, "y": 0.8 } }), "from a wall, needed is 0.25 m"),
            (json!({ "pad": { "x": 90.0, "y": 0.8 } }), "outside the plan"),
            (
                json!({ "pad": { "x": 1.0, "y": 0.8 }, "round": { "order": ["Attic"] } }),
                "`round.order` is \"Attic\"",
            ),
            (json!({ "pad": { "x": 1.0, "y": 0.8 }, "colour": 1 }), "unknown field `colour`"),
            (
                json!({ "pad": { "x": 1.0, "y": 0.8 }, "no_fly": [{ "name": "All", "rectangle": [0, 0, 4, 4] }] }),
                "no-fly zone All",
            ),
        ] {
            let error = files(&building).unwrap_err();
            assert!(error.contains(said), "{building}: {error}");
        }
    }

    #[test]
    fn a_plan_comes_with_its_picture_and_neither_without_the_other() {
        let building = json!({ "pad": { "x": 1.0, "y": 1.0 } });
        let place = json!({ "resolution_m": 0.05, "origin_x_m": 0.0, "origin_y_m": 0.0 });
        let old = Plan::from_ascii(&ROOM, 0.2);
        let present = Present { plan: &old, name: "plans/demo.yaml", radius_m: 0.25 };
        let png = picture(80);
        let files = Edit::parse(&change(&building, &place), Some(&png)).unwrap().files(&present).unwrap();
        let (header, file, bytes) = files.plan.unwrap();
        assert!(file.starts_with("demo.") && file.ends_with(".png"), "{file}");
        assert_eq!(bytes, png);
        let parsed = PlanHeader::parse("demo.yaml", header.as_bytes()).unwrap();
        assert_eq!(parsed.image, file);
        assert_eq!(Plan::load("demo.yaml", &parsed, &bytes).unwrap().width(), 80);
        for (plan, picture, said) in
            [(&place, None, "picture is missing"), (&Value::Null, Some(&png[..]), "no plan for it")]
        {
            assert!(Edit::parse(&change(&building, plan), picture).unwrap_err().contains(said));
        }
        let refused = |plan: Value, picture: &[u8]| {
            Edit::parse(&change(&building, &plan), Some(picture)).unwrap().files(&present).unwrap_err()
        };
        assert!(refused(place.clone(), b"GIF89a").contains("not a PGM or PNG image"));
        assert!(refused(place.clone(), &png[..200]).contains("not a PGM or PNG image"));
        let tiny = json!({ "resolution_m": 1e-9, "origin_x_m": 0.0, "origin_y_m": 0.0 });
        assert!(refused(tiny, &png).contains("plan.resolution_m"));
        let far = json!({ "resolution_m": 0.05, "origin_x_m": 1e9, "origin_y_m": 0.0 });
        assert!(refused(far, &png).contains("`origin` is 1000000000"));
    }

    #[test]
    fn what_it_was_made_from_is_said_and_who_made_it_is_a_name() {
        let building = json!({ "pad": { "x": 1.0, "y": 0.8 } });
        let said = |key: &str, value: Value| {
            let mut text: Value = serde_json::from_slice(&change(&building, &Value::Null)).unwrap();
            text[key] = value;
            Edit::parse(text.to_string().as_bytes(), None).map(|edit| edit.made_from)
        };
        assert_eq!(said("made_from", json!("0123456789abcdef")).unwrap(), "0123456789abcdef");
        for wrong in
            [json!(""), json!("0123456789abcdeg"), json!("0".repeat(4000)), json!("0123456789abcdéf")]
        {
            let error = said("made_from", wrong).unwrap_err();
            assert!(error.starts_with("made_from = ") && error.len() < 200, "{error}");
        }
        assert!(said("made_from", Value::Null).unwrap_err().contains("not the JSON of a change"));
        for wrong in [json!("a\nb"), json!("a".repeat(255))] {
            assert_eq!(said("account", wrong).unwrap_err(), "account: at most 254 bytes of text");
        }
    }

    #[test]
    fn no_bytes_panic() {
        let whole = change(&json!({ "pad": { "x": 1.0, "y": 0.8 } }), &Value::Null);
        for cut in 0..whole.len() {
            assert!(Edit::parse(&whole[..cut], None).is_err());
        }
        for junk in [&b"\0"[..], b"[]", b"{}", b"{\"id\":1}", &[0xff; 300]] {
            assert!(Edit::parse(junk, None).is_err());
        }
    }
}
