//! What Foxglove is shown: a topic in its well-known form where there is one, and every JSON topic as it is.

use super::clock::Clock;
use super::scene::{self, Place};
use super::schema::plain;
use anyhow::{Context as _, Result, bail};
use bridge::form::decode_particles;
use bridge::remote::Heard;
use floorplan::{Plan, PlanHeader};
use foxglove::messages::{
    CompressedVideo, FrameTransform, Grid, PoseInFrame, PosesInFrame, SceneUpdate, Timestamp,
};
use foxglove::{Channel, Context, PartialMetadata, RawChannel, Schema};
use ipc_types::{Message, Video};
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

/// Topics of a drone that are shown at most.
const MOST_TOPICS: usize = 256;
/// Topics that have a well-known form only.
const BYTES: [&str; 3] = ["localization/particles", "navigation/grid", "camera/video"];
/// Why a message is not understood.
type Reason = &'static str;

/// All channels, and what must be remembered to fill them.
pub(crate) struct Channels {
    /// Topics that leave as JSON, under their own names.
    json: BTreeMap<String, Arc<RawChannel>>,
    frame: Channel<FrameTransform>,
    pose: Channel<PoseInFrame>,
    uncertainty: Channel<SceneUpdate>,
    particles: Channel<PosesInFrame>,
    plan: Channel<Grid>,
    certainty: Channel<Grid>,
    sonar: Channel<SceneUpdate>,
    route: Channel<SceneUpdate>,
    video: Channel<CompressedVideo>,
    context: Arc<Context>,
    drawn: Plan,
    /// Which start of the localization was heard last.
    start: Option<u64>,
    /// The newest round, which comes twice a second at most and is shown at once to who begins to watch it.
    round: Value,
    clock: Clock,
    place: Option<Place>,
    height_m: f64,
}

/// The plan as the drone tells it: its picture by what `about` says of it.
fn plan_of(about: &Value, picture: &[u8]) -> Result<Plan> {
    let number =
        |key: &str| about["plan"][key].as_f64().with_context(|| format!("about: plan.{key} is no number"));
    let header = format!(
        "image: plan.png\nresolution: {}\norigin: [{}, {}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        number("resolution_m")?,
        number("origin_x_m")?,
        number("origin_y_m")?
    );
    let header = PlanHeader::parse("about", header.as_bytes())?;
    Ok(Plan::load("plan.png", &header, picture)?)
}

/// The schema of a topic by `sereno schema`; those of one service's health are alike.
fn schema_of(schemas: &Value, topic: &str) -> Option<Value> {
    let family = topic.split('/').next().unwrap_or(topic);
    schemas["topics"].get(topic).or_else(|| schemas["topics"].get(family)).map(|row| plain(&row["schema"]))
}

impl Channels {
    /// Advertises everything that the drone says it tells.
    ///
    /// # Errors
    /// When what it says of itself or of its plan is not understood.
    pub(crate) fn open(context: &Arc<Context>, about: &Value, picture: &[u8]) -> Result<Self> {
        let mut channels = Self {
            json: BTreeMap::new(),
            frame: context.channel_builder("/frames").build(),
            pose: context.channel_builder("/pose").build(),
            uncertainty: context.channel_builder("/uncertainty").build(),
            particles: context.channel_builder("/particles").build(),
            plan: context.channel_builder("/plan").build(),
            certainty: context.channel_builder("/certainty").build(),
            sonar: context.channel_builder("/sonar").build(),
            route: context.channel_builder("/round").build(),
            video: context.channel_builder("/video").build(),
            context: Arc::clone(context),
            drawn: plan_of(about, picture)?,
            start: None,
            round: Value::Null,
            clock: Clock::default(),
            place: None,
            height_m: 0.0,
        };
        channels.advertise(about)?;
        Ok(channels)
    }

    /// Advertises topics that the drone tells as JSON and that are not known yet.
    fn advertise(&mut self, about: &Value) -> Result<()> {
        let schemas = bridge::schema::topics();
        let rows = about["topics"].as_array().context("about: topics is no list")?;
        if rows.len() > MOST_TOPICS {
            bail!("about: topics: {} of them, allowed are 0 to {MOST_TOPICS}", rows.len());
        }
        for row in rows {
            let (Some(topic), Some(form), Some(kind)) =
                (row["topic"].as_str(), row["form"].as_str(), row["type"].as_str())
            else {
                bail!("about: topics: one without topic, form and type");
            };
            // What is no text would be ten times as long as text.
            if !form.starts_with("json") || self.json.contains_key(topic) {
                continue;
            }
            let schema = schema_of(&schemas, topic).map(|schema| {
                Schema::new(format!("sereno.{kind}"), "jsonschema", schema.to_string().into_bytes())
            });
            let channel = self
                .context
                .channel_builder(format!("/{topic}"))
                .message_encoding("json")
                .schema(schema)
                .build_raw()?;
            self.json.insert(topic.to_owned(), channel);
        }
        Ok(())
    }

    /// Takes over what the drone says of itself after another start: another plan, and topics that it did not tell before.
    ///
    /// # Errors
    /// When that is not understood; what was known is then kept.
    pub(crate) fn renew(&mut self, about: &Value, picture: &[u8]) -> Result<()> {
        let drawn = plan_of(about, picture)?;
        self.advertise(about)?;
        if drawn.hash() != self.drawn.hash() {
            self.drawn = drawn;
            self.show_again(&["/plan".to_owned()]);
        }
        Ok(())
    }

    /// Topics that may have viewers.
    pub(crate) fn topics(&self) -> impl Iterator<Item = &str> {
        self.json.keys().map(String::as_str).chain(BYTES)
    }

    /// Which start of its localization the drone tells of.
    pub(crate) const fn start(&self) -> Option<u64> {
        self.start
    }

    /// Whether anybody watches what is made of a topic.
    pub(crate) fn is_watched(&self, topic: &str) -> bool {
        let own = self.json.get(topic).is_some_and(|channel| channel.has_sinks());
        own || match topic {
            "localization/particles" => self.particles.has_sinks(),
            "navigation/grid" => self.certainty.has_sinks(),
            "navigation/patrol" => self.route.has_sinks(),
            "camera/video" => self.video.has_sinks(),
            _ => false,
        }
    }

    /// Whether pictures are to be asked for.
    pub(crate) fn shows_video(&self) -> bool {
        self.video.has_sinks()
    }

    /// Says again, to whoever has begun to watch these channels, what is not said often.
    pub(crate) fn show_again(&self, fresh: &[String]) {
        let now_ns = now_ns();
        if fresh.iter().any(|topic| topic == "/plan") {
            self.plan.log_with_time(&scene::plan(&self.drawn, scene::timestamp(now_ns)), now_ns);
        }
        if fresh.iter().any(|topic| topic == "/round")
            && !self.round.is_null()
            && let Ok(round) = scene::route(&self.round, scene::timestamp(now_ns))
        {
            self.route.log_with_time(&round, now_ns);
        }
    }

    /// Passes a message of the drone on.
    ///
    /// # Errors
    /// Why it is no message of this version; it is left out then, as on the page.
    pub(crate) fn take(&mut self, topic: &str, heard: &Heard) -> Result<(), Reason> {
        if heard.is_json { self.text(topic, &heard.payload) } else { self.bytes(topic, &heard.payload) }
    }

    fn text(&mut self, topic: &str, payload: &[u8]) -> Result<(), Reason> {
        let message: Value = serde_json::from_slice(payload).map_err(|_| "it is no JSON")?;
        let stamp_ns = message["header"]["stamp_ns"].as_u64().ok_or("header.stamp_ns is no whole number")?;
        let unix_ns = self.clock.unix_ns(stamp_ns, now_ns());
        if let Some(channel) = self.json.get(topic) {
            channel.log_with_meta(payload, PartialMetadata::with_log_time(unix_ns));
        }
        let at = scene::timestamp(unix_ns);
        match topic {
            "localization/pose" => self.show_place(&message, at, unix_ns)?,
            "sonar/ranges" => {
                let (cones, height_m) = scene::sonar(&message, at)?;
                self.height_m = height_m.unwrap_or(self.height_m);
                self.sonar.log_with_time(&cones, unix_ns);
            }
            "navigation/patrol" => {
                self.route.log_with_time(&scene::route(&message, at)?, unix_ns);
                self.round = message;
            }
            _ => {}
        }
        Ok(())
    }

    fn show_place(&mut self, message: &Value, at: Timestamp, unix_ns: u64) -> Result<(), Reason> {
        self.start = message["header"]["incarnation"].as_u64().or(self.start);
        self.place = Place::of(message, self.height_m)?;
        let Some(place) = self.place else { return Ok(()) };
        self.frame.log_with_time(&scene::transform(&place, at), unix_ns);
        self.pose.log_with_time(&scene::pose_in_frame(&place, at), unix_ns);
        self.uncertainty.log_with_time(&scene::uncertainty(message, &place, at)?, unix_ns);
        Ok(())
    }

    fn bytes(&mut self, topic: &str, payload: &[u8]) -> Result<(), Reason> {
        const NONE: Reason = "bytes that are no message of this version";
        let stamp_ns = payload.first_chunk().copied().map(u64::from_le_bytes).ok_or(NONE)?;
        let (now_ns, at) = (now_ns(), |unix_ns| (unix_ns, scene::timestamp(unix_ns)));
        match topic {
            "localization/particles" => {
                let set = decode_particles(payload).ok_or(NONE)?;
                // Where they are is not known on the plan before the drone is.
                let Some(place) = self.place else { return Ok(()) };
                let (unix_ns, at) = at(self.clock.unix_ns(stamp_ns, now_ns));
                self.particles.log_with_time(&scene::particles(&set, place.compass_rad, at), unix_ns);
            }
            "navigation/grid" => {
                let grid = message_of::<ipc_types::Grid>(payload, false).ok_or(NONE)?;
                let (unix_ns, at) = at(self.clock.unix_ns(stamp_ns, now_ns));
                self.certainty.log_with_time(&scene::certainty(&grid, at), unix_ns);
            }
            "camera/video" => {
                let unit = message_of::<Video>(payload, true).ok_or(NONE)?;
                let unix_ns = self.clock.unix_ns(stamp_ns, now_ns);
                // When it was taken; encoding it took a while.
                let taken_ns = unix_ns.saturating_sub(stamp_ns.saturating_sub(unit.capture_ns));
                let shown = scene::video(&unit, payload.len(), scene::timestamp(taken_ns)).ok_or(NONE)?;
                self.video.log_with_time(&shown, unix_ns);
            }
            _ => return Err("it is told as bytes"),
        }
        Ok(())
    }
}

/// A message out of its bytes; with `cut` they may end early.
fn message_of<T: Message>(bytes: &[u8], cut: bool) -> Option<Box<T>> {
    let mut message = bytemuck::allocation::zeroed_box::<T>();
    if !cut && bytes.len() != size_of::<T>() {
        return None;
    }
    bytemuck::bytes_of_mut(&mut *message).get_mut(..bytes.len())?.copy_from_slice(bytes);
    Some(message)
}

fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
#[allow(clippy::expect_used, clippy::unwrap_used, reason = "tests")]
mod tests;
