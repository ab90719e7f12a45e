//! The simulator's camera: a shutter that is opened, and pictures that come back.

use crate::source::{Frame, Pace, Source};
use ipc_types::{Format, Picture, Shutter};
use runtime::{Guard, Input, Output, Ports, StartError};

/// Half a tick of the service.
const EARLY_NS: u64 = 4_000_000;

/// Opens the shutter at the wanted pace.
pub(crate) struct Simulated {
    shutters: Output<Shutter>,
    pictures: Input<Picture>,
    newest: Option<Guard<Picture>>,
    pace: Pace,
    number: u64,
    refused: u64,
}

impl Simulated {
    pub(crate) fn new(ports: &mut Ports) -> Result<Self, StartError> {
        Ok(Self {
            shutters: ports.output()?,
            pictures: ports.input()?,
            newest: None,
            pace: Pace::default(),
            number: 0,
            refused: 0,
        })
    }
}

impl Source for Simulated {
    fn frame(&mut self, now: u64, wanted: Option<&Format>) -> Option<Frame<'_>> {
        // Before the next is taken, or two places are held.
        self.newest = None;
        if let Some(format) = wanted
            && self.pace.is_due(now, format.fps, EARLY_NS)
        {
            self.number += 1;
            let shutter = Shutter {
                frame: self.number,
                width: format.width,
                height: format.height,
                ..Shutter::default()
            };
            self.shutters.publish(&shutter);
        }
        self.newest = self.pictures.receive();
        let frame = Frame::of(self.newest.as_ref()?);
        self.refused += u64::from(frame.is_none());
        frame.filter(|_| wanted.is_some())
    }

    fn refused(&self) -> u64 {
        self.refused
    }
}
