:- module(planner_jobs,
          [ separable/2,                % +Network, -Jobs
            solution/5                  % +Jobs, +Runs, -Makespan, -Choices, -Steps
          ]).

/** <module> Coupling analysis: does a network fall apart into jobs that robots do on their own?

It does if its parts are side by side and each is done by one robot in one go, with nothing to wait for.
Then a plan is one run (a sequence of jobs) for each robot, and robots meet only in the question who does
what.

    jobs(N, Crews, Team, Floor, Free)
      N       number of jobs that need a robot, or may have one
      Crews   crew(Name, Begun, At, Ms, Work, Tables, Legs), one for each robot, by name: from Ms on it is free, at
              the place At; then it can work so long, or none: as long as it takes. Begun: it is at something
              until then. Legs (planner_legs) are what it can do
      Team    at most so many robots may have runs; those that are at something count
      Floor   floor(Ms, Choices, Steps): what needs no robot, or is under way, in any case
      Free    Job-floor(Ms, Choices, Steps): a job that can be done without a robot too
*/

:- use_module(library(assoc)).
:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(pairs)).
:- use_module(planner_golog(legs)).

%!  separable(+Network, -Jobs) is semidet.
%
%   Fails if the network does not fall apart.

separable(network(Root, Robots, Team, Travel, _, _), Jobs) :-
    catch(jobs(Root, Robots, Team, Travel, Jobs), coupled, fail).

jobs(Root, Robots, Team, Travel, jobs(N, Crews, Team, Floor, Free)) :-
    phrase(side_by_side(Root), Nodes),
    maplist(ways, Nodes, Ways),
    partition(begun, Ways, Begun, Open),
    partition(idle, Open, Idle, Work),
    foldl(start(Robots, Travel), Begun, []-floor(0, [], []), Starts-Floor0),
    maplist(quickest, Idle, Quickest),
    foldl(together, Quickest, Floor0, Floor),
    length(Work, N),
    findall(Job-Way, ( nth1(Job, Work, Some), include(computed, Some, Computed), quickest(Computed, Way) ), Free),
    findall(Robots1-Leg,
            ( nth1(Job, Work, Some), member(Way, Some), \+ computed(Way), leg(Job, Way, Travel, Robots1, Leg) ),
            Legs0),
    phrase(by_robot(Legs0), Legs1),
    keysort(Legs1, Legs2),
    group_pairs_by_key(Legs2, Legs3),
    list_to_assoc(Legs3, Legs),
    sort(1, @<, Robots, Sorted),
    maplist(crew(Travel, Starts, Legs), Sorted, Crews).

by_robot([]) --> [].
by_robot([Robots-Leg|Legs]) --> one_each(Robots, Leg), by_robot(Legs).

one_each([], _) --> [].
one_each([Robot|Robots], Leg) --> [Robot-Leg], one_each(Robots, Leg).

crew(Travel, Started, Assoc, robot(Name, Place, Limit), crew(Name, Begun, At, Ms, Work, Tables, Legs)) :-
    (   memberchk(Name-begun(At, Ms, Done), Started)
    ->  Begun = true
    ;   Begun = false, Ms = 0, Done = 0,
        place(Place, Travel, At)
    ),
    ( Limit == none -> Work = none ; Work is max(0, Limit - Done) ),
    tables(Travel, Name, Tables),
    ( get_assoc(Name, Assoc, Legs0) -> undominated(Legs0, Legs) ; Legs = [] ).

place(here, _, 0) :- !.
place(Place, travel(Index, _, _, _), At) :- get_assoc(Place, Index, At).

side_by_side(side(Nodes)) --> !, all_side_by_side(Nodes).
side_by_side(seq([])) --> !, [].
side_by_side(seq([Node])) --> !, side_by_side(Node).
side_by_side(Node) --> [Node].

all_side_by_side([]) --> [].
all_side_by_side([Node|Nodes]) --> side_by_side(Node), all_side_by_side(Nodes).

% --------------------------------------------------------------------------- ways through a part
%
%   way(Who, Labels, Choices, Own, Steps, Go): Who is a robot, its placeholder (then Labels are the robots
%   that it stands for) or none; Go is `tight` if the robot does nothing else in between, else `loose`.

ways(Node, Ways) :-
    findall(Way, way(Node, loose, Way), Ways).

way(step(Id, Robots, Goal, Odds, Ms, Ends, Claims), Go, way(Who, [], [], [], [Step], Go)) :- !,
    (   Claims == [], one(Robots, none, Who), one(Ends, none, End)
    ->  Step = step(Id, Who, Goal, Odds, Ms, End)
    ;   throw(coupled)
    ).
way(underway(Id, Robots, Ms, Ends, _), Go, way(Who, [], [], [], [underway(Id, Robots, Ms, Ends)], Go)) :- !,
    ( Robots = [Who] -> true ; Who = none ).
way(seq(Nodes), Go, Way) :- !,
    foldl(then(Go), Nodes, way(none, [], [], [], [], Go), Way).
way(side(Nodes), Go, Way) :- !,
    foldl(beside(Go), Nodes, way(none, [], [], [], [], Go), Way).
way(alt(Id, Options), Go, Way) :- !,
    member(option(Labels, Node), Options),
    way(Node, Go, Way0),
    chosen(Id, Labels, Way0, Way).
way(held(_, Robot, Node), _, way(Who, Labels, Choices, Own, Steps, Go)) :- !,
    way(Node, tight, way(Who0, Labels, Choices, Own, Steps, _)),
    (   Steps == [] -> Who = none, Go = loose
    ;   one_robot(Who0, Robot, Who) -> Go = tight
    ;   throw(coupled)
    ).
way(claimed(_, [], Node), Go, Way) :- !,
    way(Node, Go, Way).
way(_, _, _) :-
    throw(coupled).

one([], None, None).
one([One], _, One).

one_robot(none, Who, Who) :- !.
one_robot(Who, none, Who) :- !.
one_robot(Who, Who, Who).

%   One part after the other. What keeps its robot is not part of something longer that does not.
then(Go, Node, way(Who0, Labels0, Choices0, Own0, Steps0, Go0), way(Who, Labels, Choices, Own, Steps, Go2)) :-
    way(Node, Go, way(Who1, Labels1, Choices1, Own1, Steps1, Go1)),
    append(Labels0, Labels1, Labels),
    append(Choices0, Choices1, Choices),
    append(Own0, Own1, Own),
    append(Steps0, Steps1, Steps),
    (   Steps0 == [] -> Who = Who1, Go2 = Go1
    ;   Steps1 == [] -> Who = Who0, Go2 = Go0
    ;   Go0 == Go, Go1 == Go, one_robot(Who0, Who1, Who) -> Go2 = Go
    ;   throw(coupled)
    ).

%   One part at most has steps.
beside(Go, Node, Way0, Way) :-
    then(Go, Node, Way0, Way),
    Way0 = way(_, _, _, _, Before, _),
    Way = way(_, _, _, _, After, _),
    ( Before == [] -> true ; Before == After -> true ; throw(coupled) ).

chosen(none, [_], Way, Way) :- !.
chosen(Id, Labels, way(Who, Labels0, Choices, Own, Steps, Go), Way) :-
    (   Labels = [_, _|_], format(atom(Who), '?~w', [Id])
    ->  Way = way(Who, Labels, Choices, [Id|Own], Steps, Go)
    ;   Labels = [Label|_],                             % of several, none makes a difference
        Way = way(Who, Labels0, [Id-Label|Choices], Own, Steps, Go)
    ).

% ------------------------------------------------------------- what needs no robot, or has begun

computed(way(none, _, _, _, Steps, _)) :- \+ memberchk(underway(_, _, _, _), Steps).

idle(Ways) :- Ways = [_|_], maplist(computed, Ways).

begun(Ways) :- member(way(_, _, _, _, Steps, _), Ways), memberchk(underway(_, _, _, _), Steps), !.

%   The quickest of those that need no robot.
quickest(Ways, Quickest) :-
    findall(Ms-floor(Ms, Choices, Steps),
            ( member(way(_, _, Choices, _, Parts, _), Ways), compute(Parts, 0, Ms, Steps) ),
            Pairs),
    keysort(Pairs, [_-Quickest|_]).

compute([], End, End, []).
compute([step(Id, none, _, _, Ms, _)|Parts], Start, End, [step(Start, Next, Id, [])|Steps]) :-
    Next is Start + Ms,
    compute(Parts, Next, End, Steps).

together(floor(Ms0, Choices0, Steps0), floor(Ms1, Choices1, Steps1), floor(Ms, Choices, Steps)) :-
    Ms is max(Ms0, Ms1),
    append(Choices0, Choices1, Choices),
    append(Steps0, Steps1, Steps).

%   What is under way; if it is part of what keeps its robot, the rest follows at once.
start(Robots, Travel, Ways, Starts0-Floor0, Starts-Floor) :-
    (   Ways = [way(Who, [], Choices, [], [underway(_, Busy, Left, Ends)|Rest], Go)],
        \+ memberchk(underway(_, _, _, _), Rest),
        ( Rest == [] -> true ; Go == tight, \+ Busy = [_, _|_] )
    ->  true
    ;   throw(coupled)
    ),
    (   Rest == []
    ->  Done = Left, Steps = [],
        findall(Robot-begun(At, Left, 0), ( nth1(I, Busy, Robot), end(I, Ends, Robot, Robots, Travel, At) ), New)
    ;   end(1, Ends, Who, Robots, Travel, At0),
        go_on(Rest, Who, Travel, At0, Left, At, Done, Steps, Computing),
        Work is Done - Left - Computing,            % what is under way was counted when it began
        New = [Who-begun(At, Done, Work)]
    ),
    together(floor(Done, Choices, Steps), Floor0, Floor),
    append(New, Starts0, Starts).

%   Where the robot is after what is under way.
end(I, Ends, Robot, Robots, Travel, At) :-
    (   nth1(I, Ends, Place), Place \== none
    ->  true
    ;   memberchk(robot(Robot, Place, _), Robots)
    ),
    place(Place, Travel, At).

go_on(Rest, Who, Travel, At0, From, At, To, Steps, Computing) :-
    (   leg(none, way(Who, [], [], [], Rest, tight), Travel, _, Leg),
        tables(Travel, Who, Tables),
        row(Tables, At0, Row),
        leg_cost(Leg, Row, _)
    ->  leg_steps(Leg, Who, Row, From, Steps, To),
        leg_end(Leg, At0, At),
        leg_spare(Leg, Computing)
    ;   throw(coupled)
    ).

%!  solution(+Jobs, +Runs, -Makespan, -Choices, -Steps) is det.
%
%   Runs: for each crew, in their order, the legs that it does. Jobs that are in no run are done without a
%   robot. Steps are step(Start, End, Id, Robots), by start, then id.

solution(jobs(_, Crews, _, Floor, Free), Runs, Makespan, Choices, Steps) :-
    maplist(run_out, Crews, Runs, Floors),
    append(Runs, Legs),
    findall(Job, ( member(Leg, Legs), leg_job(Leg, Job) ), Done),
    findall(Alone, ( member(Job-Alone, Free), \+ memberchk(Job, Done) ), Alones),
    foldl(together, Floors, Floor, Floor1),
    foldl(together, Alones, Floor1, floor(Makespan, Choices1, Steps1)),
    sort(Choices1, Choices),
    findall((Start-Id)-step(Start, End, Id, Who), member(step(Start, End, Id, Who), Steps1), Keyed),
    keysort(Keyed, Sorted),
    pairs_values(Sorted, Steps).

run_out(crew(Name, _, At, Ms, _, Tables, _), Legs, floor(End, Choices, Steps)) :-
    foldl(one_leg(Name, Tables), Legs, out(At, Ms, [], []), out(_, End, Choices, Steps)).

one_leg(Name, Tables, Leg, out(At0, Ms0, Choices0, Steps0), out(At, Ms, Choices, Steps)) :-
    row(Tables, At0, Row),
    leg_steps(Leg, Name, Row, Ms0, Steps1, Ms),
    leg_choices(Leg, Name, Choices1),
    leg_end(Leg, At0, At),
    append(Choices1, Choices0, Choices),
    append(Steps1, Steps0, Steps).
