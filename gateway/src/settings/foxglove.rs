//! Live view of episodes in Foxglove.

use std::io;

use tandem_episodes::LiveChannels;

/// Live view of the episode that began last.
#[derive(Debug, Clone)]
pub struct FoxgloveView {
    /// Port on this machine; 0 picks a free one.
    pub port: u16,
    /// Channels of the episode's recording.
    pub channels: LiveChannels,
}

impl FoxgloveView {
    /// Returns the view on this port. It is served later.
    pub fn on(port: u16) -> FoxgloveView {
        FoxgloveView { port, channels: LiveChannels::default() }
    }

    /// Serves the view, and logs the URL that Foxglove opens.
    ///
    /// # Errors
    ///
    /// If the port cannot be used.
    pub async fn serve(&self) -> io::Result<()> {
        let FoxgloveView { port, channels } = self;
        let address = channels.serve(*port).await.map_err(|error| {
            io::Error::other(format!("cannot serve Foxglove on port {port}: {error}; try --foxglove 0"))
        })?;
        tracing::info!("Foxglove shows episodes from ws://{address}");
        Ok(())
    }
}
