//! nav2_msgs/action/NavigateToPose: the x of a goal says what becomes of it, and the feedback is its pose.

use ros2_client::Message;
use serde::{Deserialize, Serialize};

use crate::{
    scripted::Script,
    trajectories::{Header, Time},
};

#[derive(Clone, Default, Serialize, Deserialize)]
struct Point {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Clone, Default, Serialize, Deserialize)]
struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

#[derive(Clone, Default, Serialize, Deserialize)]
struct Pose {
    position: Point,
    orientation: Quaternion,
}

#[derive(Clone, Default, Serialize, Deserialize)]
struct PoseStamped {
    header: Header,
    pose: Pose,
}

#[derive(Clone, Serialize, Deserialize)]
pub struct Goal {
    pose: PoseStamped,
    behavior_tree: String,
}

#[derive(Clone, Serialize, Deserialize)]
pub struct Outcome {
    error_code: u16,
    error_msg: String,
}

#[derive(Clone, Serialize, Deserialize)]
pub struct Feedback {
    current_pose: PoseStamped,
    navigation_time: Time,
    estimated_time_remaining: Time,
    number_of_recoveries: i16,
    distance_remaining: f32,
}

impl Message for Goal {}
impl Message for Outcome {}
impl Message for Feedback {}

pub struct Navigation;

impl Script for Navigation {
    type Goal = Goal;
    type Outcome = Outcome;
    type Feedback = Feedback;

    const ACTION: [&'static str; 3] = ["/navigate_to_pose", "nav2_msgs", "NavigateToPose"];

    fn number(goal: &Goal) -> f64 {
        goal.pose.pose.position.x
    }

    fn fields(goal: &Goal) -> String {
        let (frame, to) = (&goal.pose.header.frame_id, &goal.pose.pose);
        let (y, w) = (to.position.y, to.orientation.w);
        format!("{frame} {y} {w} {}", goal.behavior_tree)
    }

    fn feedback(goal: &Goal) -> Feedback {
        Feedback {
            current_pose: goal.pose.clone(),
            navigation_time: Time::default(),
            estimated_time_remaining: Time::default(),
            number_of_recoveries: -1,
            distance_remaining: Self::number(goal) as f32 / 2.0,
        }
    }

    fn outcome(number: f64) -> Outcome {
        Outcome {
            error_code: match number {
                10.0 => 9003,
                11.0 => 9002,
                _ => 0,
            },
            error_msg: "ü".into(),
        }
    }
}
