use super::*;
use bytemuck::Zeroable;
use floorplan::Cell;
use foxglove::{ChannelId, Decode, FoxgloveError, Metadata, Sink, SinkId};
use serde_json::json;
use std::sync::{Mutex, PoisonError};

type Shown = (String, u64, Vec<u8>);

/// Watches every channel, as an app would.
struct Screen {
    id: SinkId,
    shown: Mutex<Vec<Shown>>,
}

impl Screen {
    fn take(&self) -> Vec<Shown> {
        std::mem::take(&mut *self.shown.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The only message of a topic since the last look.
    fn only<T: Decode>(&self, topic: &str) -> T {
        let shown = self.take();
        let mut of_topic = shown.iter().filter(|(name, ..)| name == topic);
        let (_, _, bytes) = of_topic.next().expect(topic);
        assert!(of_topic.next().is_none(), "{topic}: one");
        let Ok(message) = T::decode(bytes.as_slice()) else { panic!("{topic} does not decode") };
        message
    }
}

impl Sink for Screen {
    fn id(&self) -> SinkId {
        self.id
    }

    fn log(&self, channel: &RawChannel, bytes: &[u8], metadata: &Metadata) -> Result<(), FoxgloveError> {
        let shown = (channel.topic().to_owned(), metadata.log_time, bytes.to_vec());
        self.shown.lock().unwrap_or_else(PoisonError::into_inner).push(shown);
        Ok(())
    }

    fn add_channels(&self, _: &[&Arc<RawChannel>]) -> Option<Vec<ChannelId>> {
        None
    }
}

fn about(rows: &Value) -> Value {
    json!({ "plan": { "resolution_m": 0.5, "origin_x_m": -1.0, "origin_y_m": 2.0 }, "topics": rows })
}

fn rows() -> Value {
    let row = |topic: &str, form: &str, kind: &str| json!({ "topic": topic, "form": form, "type": kind });
    json!([
        row("localization/pose", "json", "Pose"),
        row("sonar/ranges", "json", "Ranges"),
        row("navigation/patrol", "json, cut", "Patrol"),
        row("localization/particles", "bytes, columns cut", "Particles"),
        row("localization/pose", "json", "Pose"),
    ])
}

/// A plan of three cells by three, walls left and above.
fn picture(shade: u8) -> Vec<u8> {
    let pixels = vec![0, 0, 0, 0, 0, 0, 0, shade, 254];
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::GrayImage::from_raw(3, 3, pixels).unwrap().write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn channels() -> (Channels, Arc<Screen>) {
    let context = Context::new();
    let screen = Arc::new(Screen { id: SinkId::next(), shown: Mutex::default() });
    context.add_sink(screen.clone());
    (Channels::open(&context, &about(&rows()), &picture(254)).unwrap(), screen)
}

fn text(message: &Value) -> Heard {
    Heard { payload: message.to_string().into_bytes(), is_json: true }
}

fn bytes(payload: &[u8]) -> Heard {
    Heard { payload: payload.to_vec(), is_json: false }
}

fn pose(x_m: f64) -> Value {
    json!({ "header": { "stamp_ns": 5_000_000_000_u64, "sequence": 1, "publisher": 1, "incarnation": 9 }, "searching": 0,
        "x_m": x_m, "y_m": 3.0, "heading_rad": 0.0, "heading_offset_rad": 0.0,
        "variance_x_m2": 0.01, "variance_y_m2": 0.01, "covariance_xy_m2": 0.0 })
}

#[test]
fn a_pose_is_shown_where_it_is_and_again_where_it_goes() {
    let (mut channels, screen) = channels();
    for x_m in [1.0, 1.5] {
        let heard = text(&pose(x_m));
        assert_eq!(channels.take("localization/pose", &heard), Ok(()));
        let shown = screen.take();
        let topics: Vec<_> = shown.iter().map(|(topic, ..)| topic.as_str()).collect();
        assert_eq!(topics, ["/localization/pose", "/frames", "/pose", "/uncertainty"]);
        assert_eq!(shown[0].2, heard.payload, "as it came");
        let place = PoseInFrame::decode(shown[2].2.as_slice()).unwrap().pose.unwrap().position.unwrap();
        assert!((place.x - x_m).abs() < 1e-9 && (place.y - 3.0).abs() < 1e-9, "{place:?}");
        assert!(shown.iter().all(|(_, time_ns, _)| *time_ns == shown[0].1), "at one time");
    }
    assert_eq!(channels.start(), Some(9));
}

#[test]
fn what_is_not_understood_is_said_and_shows_nothing_well_known() {
    let (mut channels, screen) = channels();
    let stamped = |more: Value| {
        let mut message = json!({ "header": { "stamp_ns": 1 } });
        message.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        text(&message)
    };
    let nested = "[".repeat(100_000);
    for (topic, heard, reason) in [
        ("localization/pose", Heard { payload: b"{\"x\":".to_vec(), is_json: true }, "it is no JSON"),
        ("localization/pose", Heard { payload: vec![0xff; 9], is_json: true }, "it is no JSON"),
        ("localization/pose", Heard { payload: nested.into_bytes(), is_json: true }, "it is no JSON"),
        ("localization/pose", text(&json!([1, 2])), "header.stamp_ns is no whole number"),
        (
            "localization/pose",
            text(&json!({ "header": { "stamp_ns": -1 } })),
            "header.stamp_ns is no whole number",
        ),
        ("localization/pose", stamped(json!({})), "searching is no whole number"),
        (
            "localization/pose",
            stamped(json!({ "searching": 0, "heading_rad": "north" })),
            "heading_rad is no number",
        ),
        ("sonar/ranges", stamped(json!({ "count": 1, "readings": {} })), "readings is no list"),
        ("navigation/patrol", stamped(json!({ "waypoints": "none" })), "waypoints is no list"),
        ("localization/particles", bytes(&[0; 7]), "bytes that are no message of this version"),
        ("localization/particles", bytes(&[0xff; 4096]), "bytes that are no message of this version"),
        ("navigation/grid", bytes(&[0; 64]), "bytes that are no message of this version"),
        ("camera/video", bytes(&[0xff; 300]), "bytes that are no message of this version"),
        ("camera/video", bytes(&vec![0; 1 << 20]), "bytes that are no message of this version"),
        ("something/else", bytes(&[0; 64]), "it is told as bytes"),
    ] {
        assert_eq!(channels.take(topic, &heard), Err(reason), "{topic}");
        let known = screen.take().into_iter().filter(|(shown, ..)| !shown.contains(topic)).count();
        assert_eq!(known, 0, "{topic}: {reason}");
    }
    assert_eq!(channels.take("localization/pose", &text(&pose(1.0))), Ok(()), "and goes on");
    assert_eq!(screen.take().len(), 4);
}

#[test]
fn particles_wait_for_a_place_and_a_grid_does_not() {
    let (mut channels, screen) = channels();
    let mut set = bytemuck::allocation::zeroed_box::<ipc_types::Particles>();
    set.count = 1;
    set.x_m[0] = 2.5;
    set.weight[0] = 1.0;
    let whole = bytemuck::bytes_of(&*set);
    let head = std::mem::offset_of!(ipc_types::Particles, x_m);
    let stride = 4 * ipc_types::MAX_PARTICLES;
    let mut payload = whole[..head].to_vec();
    let columns = (whole.len() - head) / stride;
    payload.extend((0..columns).flat_map(|column| whole[head + column * stride..][..4].to_vec()));
    assert_eq!(channels.take("localization/particles", &bytes(&payload)), Ok(()));
    assert!(screen.take().is_empty(), "before the drone is anywhere");
    channels.take("localization/pose", &text(&pose(1.0))).unwrap();
    screen.take();
    assert_eq!(channels.take("localization/particles", &bytes(&payload)), Ok(()));
    let cloud: PosesInFrame = screen.only("/particles");
    assert_eq!(cloud.poses.len(), 1);
    assert!((cloud.poses[0].position.unwrap().x - 2.5).abs() < 1e-6);

    let mut grid = Box::new(ipc_types::Grid::zeroed());
    grid.cell_m = 0.1;
    grid.cells[3] = 7;
    assert_eq!(channels.take("navigation/grid", &bytes(bytemuck::bytes_of(&*grid))), Ok(()));
    let shown: Grid = screen.only("/certainty");
    assert_eq!((shown.column_count, shown.data[3]), (81, 7));
}

#[test]
fn a_plan_is_shown_to_who_begins_to_watch_and_when_it_is_another() {
    let (mut channels, screen) = channels();
    channels.show_again(&["/pose".to_owned()]);
    assert!(screen.take().is_empty());
    channels.show_again(&["/plan".to_owned()]);
    let plan: Grid = screen.only("/plan");
    assert_eq!((plan.column_count, plan.data.to_vec()), (3, vec![255, 0, 0, 255, 255, 255, 255, 255, 255]));
    let corner = plan.pose.unwrap().position.unwrap();
    assert_eq!((corner.x, corner.y), (-1.0, 2.0));

    channels.renew(&about(&rows()), &picture(254)).unwrap();
    assert!(screen.take().is_empty(), "the same plan");
    let more = json!([{ "topic": "flight/power", "form": "json", "type": "Power" }]);
    channels.renew(&about(&more), &picture(0)).unwrap();
    let plan: Grid = screen.only("/plan");
    assert_eq!(plan.data[..3], [255, 255, 0]);
    assert!(channels.topics().any(|topic| topic == "flight/power"), "told by the new start alone");

    let heard = text(
        &json!({ "header": { "stamp_ns": 1 }, "waypoints": [{ "x_m": 0.0, "y_m": 0.0 }, { "x_m": 1.0, "y_m": 0.0 }] }),
    );
    channels.take("navigation/patrol", &heard).unwrap();
    screen.take();
    channels.show_again(&["/round".to_owned()]);
    let round: SceneUpdate = screen.only("/round");
    assert_eq!(round.entities[0].lines.len(), 1);
}

#[test]
fn a_drone_that_says_nonsense_of_itself_is_refused_by_field() {
    let context = Context::new();
    let said = |about: &Value, picture: &[u8]| {
        let error = Channels::open(&context, about, picture).err().expect("refused");
        format!("{error:#}")
    };
    let (good, drawn) = (about(&rows()), picture(254));
    let mut bad = good.clone();
    bad["plan"]["resolution_m"] = json!("fine");
    assert!(said(&bad, &drawn).contains("plan.resolution_m"));
    bad["plan"]["resolution_m"] = json!(-0.05);
    assert!(said(&bad, &drawn).contains("resolution"), "{}", said(&bad, &drawn));
    assert!(said(&about(&json!(7)), &drawn).contains("topics is no list"));
    assert!(said(&about(&json!([{ "topic": 3 }])), &drawn).contains("one without topic"));
    let many: Vec<_> = (0..=MOST_TOPICS).map(|_| json!({})).collect();
    assert!(said(&about(&json!(many)), &drawn).contains("257"));
    assert!(!said(&good, b"no picture").is_empty());
    assert!(!said(&Value::Null, &drawn).is_empty());
}

#[test]
fn the_picture_of_a_plan_keeps_its_three_kinds_of_cells() {
    let drawn = plan_of(&about(&rows()), &picture(205)).unwrap();
    let lowest: Vec<_> = (0..3).map(|x| drawn.cell(x, 0)).collect();
    assert_eq!(lowest, [Cell::Occupied, Cell::Unknown, Cell::Free]);
}
